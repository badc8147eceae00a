#!/bin/sh
# The Python package of plugin-api/python: everything that needs no renderer but our own.
. tests/hosts/find-python
export PYTHONPATH=plugin-api/python:tests/hosts
for t in files package script sequence replay; do "$python" tests/hosts/test_$t.py "$@" || exit; done
