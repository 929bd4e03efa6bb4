#!/usr/bin/env bash
# The Snakemake workflow on a Slurm of one machine, started here on the loopback. usage: check_slurm.sh BIN_DIR FIXTURES WORK_DIR
# OSTEO_BATCH_CASES and OSTEO_BATCH_BROKEN: how many (20, 2). Exits 77 (skipped) without Slurm, munge, Snakemake or root.
set -euo pipefail
for tool in slurmctld slurmd sbatch munged snakemake; do
  command -v $tool >/dev/null || { echo "skipped: no $tool"; exit 77; }
done
[ "$(id -u)" -eq 0 ] || { echo "skipped: not root"; exit 77; }
d=$(mktemp -d /tmp/osteo-slurm-XXXXXX) # short: the socket's path is bounded
host=$(hostname -s)
stop() {
  for f in slurmd.pid slurmctld.pid munge/pid; do [ ! -s "$d/$f" ] || kill "$(cat "$d/$f")" 2>/dev/null || true; done
  sleep 1
  rm -rf "$d"
}
trap stop EXIT
mkdir -m 700 "$d/munge" && mkdir "$d/state" "$d/spool" "$d/log" && chmod 755 "$d"
head -c 1024 /dev/urandom >"$d/munge/key" && chmod 400 "$d/munge/key"
port=$((20000 + $$ % 20000)) # two on one machine must not meet
munged --force --key-file="$d/munge/key" --socket="$d/munge/sock" --pid-file="$d/munge/pid" --log-file="$d/munge/log" --seed-file="$d/munge/seed"
cat >"$d/slurm.conf" <<CONF
ClusterName=ci
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
CredType=cred/munge
AuthInfo=socket=$d/munge/sock
SlurmctldPort=$port
SlurmdPort=$((port + 1))
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
StateSaveLocation=$d/state
SlurmdSpoolDir=$d/spool
SlurmctldPidFile=$d/slurmctld.pid
SlurmdPidFile=$d/slurmd.pid
SlurmctldLogFile=$d/log/slurmctld.log
SlurmdLogFile=$d/log/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
ReturnToService=2
MinJobAge=3600
KillWait=5
$(slurmd -C | head -n 1) NodeAddr=127.0.0.1 State=UNKNOWN
PartitionName=ci Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$d/slurm.conf
slurmctld -c -f "$d/slurm.conf" && slurmd -c -f "$d/slurm.conf"
idle=no
for _ in $(seq 150); do
  if timeout 5 sinfo -h -o %T 2>/dev/null | grep -q idle; then idle=yes && break; fi
  sleep 0.2
done
[ $idle = yes ] || { echo "skipped: Slurm does not start here"; tail -n 5 "$d"/log/*; exit 77; }
OSTEO_BATCH_PROFILE=slurm OSTEO_BATCH_CASES=${OSTEO_BATCH_CASES:-20} OSTEO_BATCH_BROKEN=${OSTEO_BATCH_BROKEN:-2} \
  python3 "$(dirname "$(readlink -f "$0")")/check_batch.py" "$1" "$2" "$3"
