#!/bin/sh
# `lull-study` built with the sanitizer, over HTTP.
exec sh "$(dirname "$0")/../cli/lull_study.sh"
