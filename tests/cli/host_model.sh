#!/bin/sh
# A few random histories of interrupts, kills and full disks (tests/model/host.py); `make host-model` plays 1,000 runs. The seeds are two
# whose histories notice a write that fails unseen, a manifest that forgets and an interruption without a checkpoint.
cd "$(dirname "$0")/../.." || exit 2
python3 tests/model/host.py --runs 10 --seed 7 && python3 tests/model/host.py --runs 5 --seed 12
