#!/bin/sh
# A few random histories of interrupts, kills and full disks (tests/model/host.py); `make host-model` plays 1,000 runs.
cd "$(dirname "$0")/../.." || exit 2
python3 tests/model/host.py --runs 12 --seed 5
rc=$?
echo "1..1"
exit $rc
