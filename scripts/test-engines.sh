#!/usr/bin/env bash
# The Cornell box under Slurm, Open MPI and MPICH, with workers killed, and across "hosts" whose links are cut: the same
# bytes as `radwalk run`. Slurm and both mpiruns are installed from Debian where they are missing; every daemon keeps to
# a scratch folder and is taken down at the end. What the machine forbids is skipped, and counted as skipped.
set -euo pipefail
cd "$(dirname "$0")/.."

# With the features of the whole workspace, so that what other builds have made serves here, too.
cargo build --quiet --locked --workspace --bin radwalk
PATH="$(cargo metadata --no-deps --format-version 1 --locked | sed 's/.*"target_directory":"\([^"]*\)".*/\1/')/debug:$PATH"
radwalk=$(readlink -f "$(command -v radwalk)")
job=configs/cornell.toml
paths=12000000

scratch=$(mktemp -d /tmp/radwalk-engines.XXXXXX)
chmod 755 "$scratch" # the munge daemon insists
passed=() skipped=() failed=()
pids=()      # whatever was started here and may still be there
namespaces=()

say() { echo "engines: $*"; }
pass() { passed+=("$1") && say "passed: $1"; }
skip() { skipped+=("$1") && say "SKIPPED: $1 ($2)"; }
fail() {
    failed+=("$1")
    say "FAILED: $1 ($2)"
    tail -n 4 "$scratch"/*.log 2>/dev/null || true
}

# Whether a process is there, and no zombie.
alive() { [ -d "/proc/$1" ] && ! grep -q '^State:.Z' "/proc/$1/status" 2>/dev/null; }

# until_true SECONDS COMMAND…: whether the command succeeds before the time is over.
until_true() {
    local end=$((SECONDS + $1))
    shift
    until "$@"; do
        [ "$SECONDS" -lt "$end" ] || return 1
        sleep 0.1
    done
}
gone() { ! alive "$1"; }

# ends PID SECONDS: waits for a child and returns its exit code; 124 and a kill where it takes too long.
ends() {
    if until_true "$2" gone "$1"; then
        local code=0
        wait "$1" || code=$?
        return $code
    fi
    kill -KILL "$1" 2>/dev/null || true
    wait "$1" 2>/dev/null || true
    return 124
}

clean_up() {
    local pid
    slurm_down
    for pid in "${pids[@]}" $(workers "$scratch"); do
        if alive "$pid"; then kill -KILL "$pid" 2>/dev/null || true; fi
    done
    for pid in "${namespaces[@]}"; do kill -KILL "$pid" 2>/dev/null || true; done
    ip link delete "$bridge" 2>/dev/null || true
    if [ ${#failed[@]} = 0 ]; then rm -rf "$scratch"; else say "what is left is in $scratch"; fi
}

# The worker processes of an access file, or of a folder of them.
workers() {
    local pid
    for pid in $(pgrep -f -- "work .*--access $1" || true); do
        [ "$(readlink -f "/proc/$pid/exe" 2>/dev/null)" != "$radwalk" ] || echo "$pid"
    done
}

as_root() { if [ "$(id -u)" = 0 ]; then "$@"; else sudo -n "$@"; fi; }

# have PACKAGE… : installs what is missing.
have() {
    dpkg -s "$@" >/dev/null 2>&1 && return
    as_root apt-get update -qq >"$scratch/apt.log" 2>&1 &&
        as_root env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$@" \
            >>"$scratch/apt.log" 2>&1
}

# ---- the job ----

# coordinate NAME [HOST]: begins a coordinator; its process is $coordinator, its access file $access.
coordinate() {
    out="$scratch/$1" access="$scratch/$1.json" events="$scratch/$1.log"
    radwalk coordinate $job --paths $paths --json --listen "${2:-127.0.0.1}:0" --out "$out" --access "$access" \
        >/dev/null 2>"$events" &
    coordinator=$!
    pids+=("$coordinator")
}

# Whether the last event of a run says that $1 workers are at work and that some walks are in.
at_work() { tail -n 1 "$events" 2>/dev/null | grep -q "\"paths\":[1-9].*\"workers\":$1[,}]"; }

told() { grep -q "$1" "$events"; }

value() { sed -n "s/^ *\"$2\": \"\{0,1\}\([^\",]*\).*/\1/p" "$1/summary.json" | head -n 1; }

# same OUT: whether a run came to the bytes of the straight one.
same() {
    cmp -s "$1/patches.csv" "$scratch/straight/patches.csv" &&
        [ "$(value "$1" tally_hash)" = "$(value "$scratch/straight" tally_hash)" ]
}

# judge WHAT NAMES [LOST]: ends the run that is under way and holds it against the straight one. NAMES: what its workers
# are called; LOST: how many were lost, at least.
judge() {
    local code=0
    ends "$coordinator" 120 || code=$?
    if [ $code != 0 ]; then
        fail "$1" "the coordinator ended with $code"
    elif ! same "$out"; then
        fail "$1" "its bytes differ from those of radwalk run"
    elif [ "$(grep -c "\"name\": \"$2" "$out/summary.json")" -lt "${4:-1}" ]; then
        fail "$1" "its workers are called otherwise than $2"
    elif [ "$(value "$out" workers_lost)" -lt "${3:-0}" ]; then
        fail "$1" "no worker was lost"
    else
        pass "$1"
    fi
}

# kill_one: kills one of the workers of the run that is under way.
kill_one() {
    local victim
    victim=$(workers "$access" | tail -n 1)
    kill -KILL "$victim"
}

# ---- Slurm ----

slurm_port=$((20000 + RANDOM % 10000))

# slurm_conf HEAD NODES: a Slurm of its own, with its own munge.
slurm_conf() {
    export SLURM_CONF="$slurm/slurm.conf"
    cat >"$SLURM_CONF" <<CONF
ClusterName=test
SlurmctldHost=$(uname -n)($1)
SlurmctldPort=$slurm_port
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$slurm/munge/socket
MpiDefault=none
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SlurmdParameters=config_overrides
ReturnToService=2
KillWait=5
TCPTimeout=2
MessageTimeout=5
StateSaveLocation=$slurm/state
SlurmdSpoolDir=$slurm/%n
SlurmctldPidFile=$slurm/slurmctld.pid
SlurmdPidFile=$slurm/slurmd.%n.pid
SlurmctldLogFile=$slurm/slurmctld.log
SlurmdLogFile=$slurm/slurmd.%n.log
$2
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
}

# slurm_up HEAD NODES START: configures and starts Slurm; START starts its nodes.
slurm_up() {
    slurm=$(mktemp -d "$scratch/slurm.XXXX")
    chmod 755 "$slurm"
    mkdir "$slurm/munge" "$slurm/state"
    slurm_conf "$1" "$2"
    head -c 128 /dev/urandom >"$slurm/munge/key"
    chmod 600 "$slurm/munge/key"
    munged --key-file="$slurm/munge/key" --socket="$slurm/munge/socket" --pid-file="$slurm/munge/pid" \
        --log-file="$slurm/munge/log" --seed-file="$slurm/munge/seed" >"$scratch/munged.log" 2>&1 &&
        slurmctld -c >"$scratch/slurmctld.log" 2>&1 && "$3" &&
        until_true 20 all_idle
}
all_idle() { [ -n "$(sinfo -h -o %T 2>/dev/null)" ] && [ "$(sinfo -h -o %T 2>/dev/null | sort -u)" = idle ]; }
four_nodes() {
    local node
    for node in n1 n2 n3 n4; do
        mkdir "$slurm/$node"
        slurmd -N $node >"$scratch/slurmd.log" 2>&1 || return
    done
}

slurm=""
slurm_down() {
    [ -n "$slurm" ] || return 0
    local pid file
    timeout -s KILL 10 scontrol shutdown >/dev/null 2>&1 || true
    for file in "$slurm"/slurm*.pid "$slurm/munge/pid"; do
        pid=$(cat "$file" 2>/dev/null) || continue
        [[ $file == */munge/pid ]] || until_true 5 gone "$pid" || true
        if alive "$pid"; then kill "$pid" 2>/dev/null || true; fi
    done
    slurm=""
}

under_srun() {
    coordinate srun
    srun -n4 --kill-on-bad-exit=0 --wait=0 radwalk work --access "$access" >"$scratch/srun-work.log" 2>&1 &
    pids+=($!)
    until_true 30 at_work 4 && kill_one || true
    judge "srun -n4, one worker killed" "Slurm [0-9]*\.0 rank [0-3]/4 at" 1 4
}

# Relays with workers of their own, one of which is killed: to the coordinator the relays are the workers.
relays_under_srun() {
    coordinate srun-relays
    srun -n2 --kill-on-bad-exit=0 --wait=0 scripts/node.sh "$access" 2 >"$scratch/srun-relays-work.log" 2>&1 &
    pids+=($!)
    if until_true 30 at_work 2; then kill_behind_relays; fi
    judge "srun -n2 of relays (scripts/node.sh), one worker behind them killed" "relay Slurm [0-9]*\.[0-9]* rank [01]/2 at" 0 2
}
relays_under_mpirun() {
    coordinate "$1-relays"
    RADWALK_RELAYS=1 MPIRUN=$1 scripts/mpirun.sh "$access" -n 2 "${@:2}" >"$scratch/$1-relays-work.log" 2>&1 &
    local mpirun=$!
    pids+=("$mpirun")
    if until_true 30 at_work 2; then kill_behind_relays; fi
    judge "$1 -n 2 of relays (scripts/mpirun.sh), one worker behind them killed" "relay .*rank [01]/2 at" 0 2
    ends "$mpirun" 20 || true
}
# The access files of relays lie in folders of their own.
kill_behind_relays() {
    local pid
    for pid in $(pgrep -f -- "radwalk work --quiet --wait 600 --access .*/relay.json" || true); do
        [ "$(readlink -f "/proc/$pid/exe" 2>/dev/null)" = "$radwalk" ] || continue
        kill -KILL "$pid"
        return
    done
}

under_an_array() {
    coordinate array
    sbatch --array=0-2 --output="$scratch/array-%a.log" scripts/slurm/workers.sbatch "$access" >/dev/null
    until_true 30 at_work 3 && kill_one || true
    judge "sbatch --array=0-2 (scripts/slurm/workers.sbatch), one worker killed" "Slurm [0-9]*_[0-2]\.0 rank 0/1" 1 3
}

# A job with its coordinator in the allocation is told to end, and goes on as a heterogeneous job.
under_sbatch() {
    local what="sbatch -n3 (scripts/slurm/run.sbatch), ended by a signal and resumed as a heterogeneous job" id
    out="$scratch/sbatch" events="$scratch/sbatch.log"
    local arguments=(scripts/slurm/run.sbatch $job --paths $((10 * paths)) --json --out "$out")
    export RADWALK_HOST=127.0.0.1
    id=$(sbatch --parsable -n3 --output="$events" "${arguments[@]}")
    until_true 30 at_work 3 || true
    scancel --batch --signal=TERM "$id"
    until_true 30 no_jobs || true
    if [ "$(value "$out" paths)" -ge $paths ] 2>/dev/null; then
        fail "$what" "it was over before it could be ended"
        return
    fi
    events="$scratch/hetjob.log"
    arguments=(scripts/slurm/run.sbatch $job --paths $paths --json --out "$out")
    sbatch --parsable -n1 --output="$events" : -n3 "${arguments[@]}" >"$scratch/hetjob-id.log"
    until_true 60 no_jobs || true
    if ! same "$out"; then
        fail "$what" "its bytes differ from those of radwalk run"
    elif ! grep -q '"name": "Slurm [0-9]*\.0 rank [0-2]/3' "$out/summary.json"; then
        fail "$what" "its workers are called otherwise"
    else
        pass "$what"
    fi
    rm -f .radwalk-*.json
}
no_jobs() { [ -z "$(squeue -h 2>/dev/null)" ]; }

# ---- mpirun ----

under_mpirun() {
    coordinate "$1"
    MPIRUN=$1 scripts/mpirun.sh "$access" -n 3 "${@:3}" >"$scratch/$1-work.log" 2>&1 &
    local mpirun=$!
    pids+=("$mpirun")
    until_true 30 at_work 3 && kill_one || true
    judge "$1 -n 3 (scripts/mpirun.sh), one rank killed" "$2" 1 3
    ends "$mpirun" 20 || true
}

# ---- hosts ----

bridge=rw$((RANDOM % 10000))

# Three network namespaces on a bridge, at 10.77.0.11 … 13; this machine is 10.77.0.1.
hosts_up() {
    ip link add "$bridge" type bridge && ip addr add 10.77.0.1/24 dev "$bridge" && ip link set "$bridge" up || return
    local host pid
    for host in 1 2 3; do
        unshare --net sleep 1000 &
        pid=$!
        disown "$pid"
        namespaces+=("$pid")
        until_true 5 apart "$pid" || return
        ip link add "$bridge.$host" type veth peer name eth0 netns "$pid" &&
            ip link set "$bridge.$host" master "$bridge" up &&
            nsenter --net="/proc/$pid/ns/net" ip addr add "10.77.0.1$host/24" dev eth0 &&
            nsenter --net="/proc/$pid/ns/net" ip link set eth0 up &&
            nsenter --net="/proc/$pid/ns/net" ip link set lo up || return
    done
}
apart() { [ "$(readlink "/proc/$1/ns/net")" != "$(readlink /proc/self/ns/net)" ]; }

# Every slurmd within its namespace, under a name of its own.
three_hosts() {
    local host
    for host in 1 2 3; do
        mkdir "$slurm/h$host"
        nsenter --net="/proc/${namespaces[host - 1]}/ns/net" \
            unshare --uts sh -c "hostname h$host && exec slurmd -N h$host" >"$scratch/slurmd.log" 2>&1 || return
    done
}

# links UP-OR-DOWN HOST…
links() {
    local host
    for host in "${@:2}"; do ip link set "$bridge.$host" "$1"; done
}

silent() { [ "$(grep -c "went silent" "$events")" -ge "$1" ]; }

# A run of three hosts begins; the process of srun is $srun.
on_three_hosts() {
    coordinate "$1" 10.77.0.1
    srun -N3 -n3 --kill-on-bad-exit=0 --wait=0 --no-kill radwalk work --access "$access" \
        >"$scratch/$1-work.log" 2>&1 &
    srun=$!
    pids+=("$srun")
    until_true 30 at_work 3
}

# While all links are down, the run cannot end.
all_links_cut() {
    local began
    on_three_hosts storm || true
    links down 1 2 3
    began=$SECONDS
    until_true 30 silent 3 || true
    say "three hosts fell silent and were given up within $((SECONDS - began)) s"
    links up 1 2 3
    judge "three hosts whose links were all cut for a while" "Slurm [0-9]*.0 rank [0-2]/3 at h[1-3]:" 3 3
    ends "$srun" 60 || true
}

# The others do not wait for the one that is cut off, and it goes home when it is back.
one_link_cut() {
    local code=0 began
    on_three_hosts island || true
    links down 2
    began=$SECONDS
    judge "three hosts, one cut off until the others were done" "Slurm [0-9]*.0 rank [0-2]/3 at h[1-3]:" 0 3
    say "the run ended $((SECONDS - began)) s after the cut"
    links up 2
    ends "$srun" 120 || code=$?
    if [ $code = 0 ]; then
        pass "a worker that was cut off until the end goes home"
    else
        fail "a worker that was cut off until the end goes home" "srun ended with $code"
    fi
}

# ---- all of it ----

trap clean_up EXIT
trap 'exit 130' INT TERM

say "the straight run"
radwalk run $job --paths $paths --quiet --out "$scratch/straight"

if ! command -v apt-get >/dev/null; then
    skip "Slurm, Open MPI, MPICH, partitions" "this is no Debian"
elif ! have openmpi-bin mpich slurmctld slurmd slurm-client munge iproute2 procps; then
    skip "Slurm, Open MPI, MPICH, partitions" "they cannot be installed: $(tail -n 1 "$scratch/apt.log")"
else
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    under_mpirun mpirun.openmpi "Open MPI rank [0-2]/3 at" --oversubscribe
    under_mpirun mpirun.mpich "PMI rank [0-2]/3 at"
    relays_under_mpirun mpirun.openmpi --oversubscribe
    relays_under_mpirun mpirun.mpich
    if [ "$(id -u)" != 0 ]; then
        skip "Slurm, partitions" "they need root"
    else
        nodes="NodeName=n[1-4] NodeHostname=$(uname -n) NodeAddr=127.0.0.1 Port=[$((slurm_port + 1))-$((slurm_port + 4))] CPUs=2"
        if slurm_up 127.0.0.1 "$nodes" four_nodes; then
            under_srun
            relays_under_srun
            under_an_array
            under_sbatch
        else
            skip "Slurm" "its daemons do not start: $(tail -n 1 "$slurm/slurmctld.log" 2>/dev/null)"
        fi
        slurm_down
        nodes="NodeName=h[1-3] NodeAddr=10.77.0.1[1-3] CPUs=2 Port=$((slurm_port + 1))"
        if ! hosts_up 2>"$scratch/hosts.log"; then
            skip "partitions" "no network namespaces here: $(tail -n 1 "$scratch/hosts.log")"
        elif ! slurm_up 10.77.0.1 "$nodes" three_hosts; then
            skip "partitions" "Slurm does not start in network namespaces"
        else
            all_links_cut
            one_link_cut
        fi
    fi
fi

say "passed ${#passed[@]}, failed ${#failed[@]}, skipped ${#skipped[@]}"
[ ${#failed[@]} = 0 ]
