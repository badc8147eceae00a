#!/bin/sh
# The Python package of plugin-api/python: everything that needs no renderer but our own.
. tests/hosts/find-python
PYTHONPATH=plugin-api/python:tests/hosts exec "$python" tests/hosts/test_package.py "$@"
