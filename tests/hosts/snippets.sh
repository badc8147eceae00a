#!/bin/sh
# Every snippet of every page, as it is written: run, or at least its commands and options are there.
BUILD=${BUILD:-build}
export BUILD PYTHONPATH=plugin-api/python:tests/hosts
. tests/hosts/find-python
exec "$python" tests/hosts/test_snippets.py
