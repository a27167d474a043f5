#!/bin/sh
# In place of `crownfit fit CAPTURE -o RESULT ...`: does what the capture's name says, in no time.
# $PRETEND_RESULT: folder with a result to hand out.
set -eu
capture=$2 result=$4
case $(basename "$capture") in
  crash*) kill -SEGV $$ ;;
  once*) # crashes the first time
    if [ ! -e "$capture/tried" ]; then : >"$capture/tried"; kill -SEGV $$; fi ;;
  hang*) exec sleep 1000 ;;
  greedy*) exec python3 -c 'import time; x = bytearray(300 << 20); time.sleep(1000)' ;;
  wrong*) echo "crownfit: $capture/capture.json: photographs: there is none" >&2; exit 2 ;;
  slow*) sleep 2 ;;
esac
mkdir -p "$result"
cp -r "$PRETEND_RESULT/." "$result/"
