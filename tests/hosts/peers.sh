#!/bin/sh
# scripts/lab peers: what it makes of figures, and one tiny scene in both renderers.
. tests/hosts/find-python
BUILD=${BUILD:-build}
export BUILD
exec "$python" tests/hosts/test_peers.py
