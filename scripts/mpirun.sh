#!/bin/sh
# Workers under mpirun, for a coordinator that runs elsewhere (radwalk coordinate):
#
#     scripts/mpirun.sh ACCESS [options of mpirun, such as -n 64 --hostfile FILE]
#
# RADWALK_RELAYS=1: each rank is a relay with workers behind it, one per core (scripts/node.sh); start one rank a node then:
# -n 16 --map-by ppr:1:node (Open MPI) or -ppn 1 (Hydra).
#
# ACCESS lies on a folder that all hosts share. Nothing of MPI is used but its way to start processes. A rank that dies
# must not take the others down, which is what mpirun does unless told otherwise. MPIRUN: the launcher [default: mpirun].
set -eu
access=$1
shift
mpirun=${MPIRUN:-mpirun}
here=$(cd "$(dirname "$0")" && pwd)
work() { if [ -n "${RADWALK_RELAYS:-}" ]; then echo "$here/node.sh"; else echo "radwalk work --access"; fi; }
case $("$mpirun" --version) in
*"(Open MPI) "[5-9]*)
    # Not run here; from the documents of PRRTE, which starts the processes since version 5.
    set -- --runtime-options recoverable,continuous "$@"
    ;;
*"Open MPI"* | *OpenRTE*)
    # Its signal to end is followed by SIGKILL a second later, unless told otherwise.
    set -- --enable-recovery --mca orte_abort_on_non_zero_status 0 --mca odls_base_sigkill_timeout 6 "$@"
    ;;
*HYDRA*)
    # Nothing keeps Hydra from ending all ranks when one dies (with -disable-auto-cleanup some live on, some do not).
    # So its ranks are shells, in which a worker that was killed is started again. A lost host still ends all.
    exec "$mpirun" "$@" sh -c 'while $2 "$1"; [ $? -gt 128 ]; do :; done' rank "$access" "$(work)"
    ;;
*)
    echo "$mpirun is neither Open MPI's nor Hydra (MPICH, Intel MPI), so what keeps its other ranks alive when one dies is not known; set MPIRUN" >&2
    exit 2
    ;;
esac
# Two words, or one.
# shellcheck disable=SC2046
exec "$mpirun" "$@" $(work) "$access"
