#!/bin/sh
# A relay and the workers behind it, on one node, for a coordinator that runs elsewhere:
#
#     scripts/node.sh ACCESS [WORKERS]                          WORKERS: one per core, where nothing is said
#     srun --ntasks-per-node=1 -K0 --wait=0 scripts/node.sh ACCESS
#     mpirun --map-by ppr:1:node … scripts/node.sh ACCESS       (the options that scripts/mpirun.sh gives)
#
# The coordinator then has one connection a node, which brings the merged results of all its workers. The workers talk to
# their relay within the node, by an access file in a private folder. A worker that dies is started again; a relay that dies
# takes the node's workers down with it, and its walks go to others. Exits with the relay's code.
set -u
access=$1
workers=${2:-$(nproc)}
folder=$(mktemp -d) || exit 3
mine="$folder/relay.json"

radwalk relay --access "$access" --out-access "$mine" --listen 127.0.0.1:0 --wait 600 &
relay=$!
started=
trap 'kill -TERM $relay 2>/dev/null' TERM INT

# A shell for each worker, which starts it again where a signal ended it.
n=0
while [ "$n" -lt "$workers" ]; do
    sh -c 'while radwalk work --quiet --wait 600 --access "$1"; [ $? -gt 130 ] && kill -0 "$2" 2>/dev/null; do :; done' \
        worker "$mine" "$relay" &
    started="$started $!"
    n=$((n + 1))
done

# A signal interrupts the waiting, not the relay, which sends its workers home.
while kill -0 $relay 2>/dev/null; do
    wait $relay
    code=$?
done
# Workers that were still looking for a relay that never came, or went without a word, have nothing left to do.
for worker in $started; do
    pkill -TERM -P "$worker" 2>/dev/null
    kill "$worker" 2>/dev/null
done
wait
rm -rf "$folder"
exit "$code"
