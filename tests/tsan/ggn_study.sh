#!/bin/sh
# `ggn study` built with the sanitizer, over HTTP.
exec sh "$(dirname "$0")/../cli/ggn_study.sh"
