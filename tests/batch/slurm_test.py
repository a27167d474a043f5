#!/usr/bin/env python3
"""slurm_test.py CROWNFIT CAPTURE FITS: brings up a Slurm on this machine and fits FITS crowns through it: to the end; past
a killed task, a requeue and a restarted slurmd; with the results of one machine, byte for byte. Exit code 77: no Slurm
here, or not root."""
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path

program, capture, fits = sys.argv[1], Path(sys.argv[2]).resolve(), int(sys.argv[3])
for tool in ("slurmctld", "slurmd", "sbatch", "munged"):
    if not shutil.which(tool, path=os.environ["PATH"] + ":/usr/sbin"):
        print(f"NOT RUN: no {tool} here (Debian: slurm-wlm, munge)")
        sys.exit(77)
if os.geteuid() != 0:
    print("NOT RUN: Slurm's daemons want root")
    sys.exit(77)
os.environ["PATH"] += ":/usr/sbin"
host = socket.gethostname().split(".")[0]


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Cluster:
    """Of one node: this machine."""

    def __init__(self, folder):
        self.folder = folder
        for name in ("munge", "state", "spool", "log"):
            (folder / name).mkdir()
        os.chmod(folder, 0o755)
        shutil.chown(folder / "munge", "munge", "munge")
        memory = int(re.search(r"MemTotal:\s+(\d+)", Path("/proc/meminfo").read_text())[1]) // 1024 - 1024
        (folder / "slurm.conf").write_text(f"""ClusterName=crownfit
SlurmctldHost={host}(127.0.0.1)
AuthType=auth/munge
AuthInfo=socket={folder}/munge/munge.socket,cred_expire=5
CryptoType=crypto/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/log/slurmctld.log
SlurmdLogFile={folder}/log/slurmd.log
SlurmctldPort={free_port()}
SlurmdPort={free_port()}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SwitchType=switch/none
SchedulerType=sched/backfill
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
ReturnToService=2
JobRequeue=1
MinJobAge=3600
MaxArraySize=1001
SchedulerParameters=batch_sched_delay=0,sched_min_interval=200000,sched_interval=1,bf_interval=1
InactiveLimit=0
KillWait=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={os.cpu_count()} RealMemory={memory} State=UNKNOWN
PartitionName=batch Nodes={host} Default=YES MaxTime=INFINITE State=UP
""")
        os.environ["SLURM_CONF"] = str(folder / "slurm.conf")
        munge = folder / "munge"
        subprocess.run(["runuser", "-u", "munge", "--", "munged", "--key-file=/etc/munge/munge.key", f"--socket={munge}/munge.socket",
                        f"--pid-file={munge}/munged.pid", f"--log-file={munge}/munged.log", f"--seed-file={munge}/seed"], check=True)
        subprocess.run(["slurmctld", "-f", folder / "slurm.conf"], check=True)
        self.start_node()
        self.wait_for(lambda: "idle" in asked("sinfo", "-h", "-o", "%T"), "a node that is idle", 60)

    def start_node(self):
        subprocess.run(["slurmd", "-f", self.folder / "slurm.conf", "-N", host], check=True)

    def wait_for(self, holds, what, seconds):
        until = time.time() + seconds
        while not holds():
            if time.time() > until:
                print(asked("squeue"), asked("sinfo"), *(p.read_text()[-2000:] for p in (self.folder / "log").iterdir()), sep="\n")
                raise AssertionError(f"no {what} within {seconds} s")
            time.sleep(0.2)

    def kill(self, name, how):
        try:
            os.kill(int((self.folder / name).read_text()), how)
        except (OSError, ValueError):
            pass

    def stop(self):
        subprocess.run(["scancel", "-u", "root"], capture_output=True)
        time.sleep(1)
        for name in ("slurmd.pid", "slurmctld.pid", "munge/munged.pid"):
            self.kill(name, signal.SIGTERM)
        time.sleep(0.5)


def asked(*command):
    return subprocess.run(list(map(str, command)), capture_output=True, text=True).stdout


def batch(*arguments, expect=0):
    done = subprocess.run([program, "batch", *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == expect, (arguments, done.returncode, done.stdout, done.stderr)
    return done.stdout


def materials(root):
    return {p.parent.name: p.read_bytes() for p in root.glob("crowns/*/material.json")}


with tempfile.TemporaryDirectory() as temporary:
    folder = Path(temporary)
    os.chmod(folder, 0o755)  # munged works as a user of its own
    (folder / "cluster").mkdir()
    manifest, out = folder / "manifest.csv", folder / "out"
    manifest.write_text("id,capture,max_pixels\n" + "".join(f"c{i:03},{capture},{200 + 10 * i}\n" for i in range(fits)))
    try:
        cluster = Cluster(folder / "cluster")
    except (subprocess.CalledProcessError, AssertionError, LookupError) as e:
        print("NOT RUN: Slurm can't be brought up here:", e)
        sys.exit(77)
    try:
        begin = time.time()
        print(batch(manifest, "-o", out, "--slurm"), end="")
        assert "still in the queue" in batch(manifest, "-o", out, "--slurm"), "the same command must not submit twice"
        tasks = lambda: [line.split() for line in asked("squeue", "-h", "-r", "-o", "%A %K %T").splitlines()]
        running = lambda: [t for t in tasks() if t[2] == "RUNNING"]
        cluster.wait_for(running, "running task", 30)
        # One is cancelled, as an impatient user would; one is requeued, as for a job that matters more.
        victims = running()
        subprocess.run(["scancel", f"--signal=KILL", "--full", victims[0][0]], check=True)
        print("killed: task", victims[0][1])
        cluster.wait_for(lambda: any(t not in victims for t in running()), "next task", 60)
        requeued = running()[-1]
        subprocess.run(["scontrol", "requeue", requeued[0]], check=True)
        print("requeued: task", requeued[1])
        # A slurmd that dies while it still clears a requeued task away takes that task's next turn for a second copy and
        # drains its node; that is Slurm's own affair.
        cluster.wait_for(lambda: running() and all(t[2] in ("RUNNING", "PENDING") for t in tasks()), "running task", 60)
        time.sleep(2)
        cluster.kill("slurmd.pid", signal.SIGKILL)
        time.sleep(1)
        cluster.start_node()
        print("slurmd killed and started again")
        print(batch("status", out), end="")
        cluster.wait_for(lambda: not tasks(), "end of all tasks", 60 + 60 * fits)
        print(f"array of {fits}: {time.time() - begin:.0f} s")
        left = re.search(r"(\d+) waiting", batch("status", out))
        print(f"after the array: {left[1] if left else 0} crowns without a result")
        if left:  # what died is submitted by the same command
            print(batch(manifest, "-o", out, "--slurm"), end="")
            cluster.wait_for(lambda: not tasks(), "end of all tasks", 60 + 60 * fits)
        said = subprocess.run([program, "batch", "collect", str(out)], capture_output=True, text=True).stdout
        assert f"{fits} crowns" in said and "waiting" not in said, said
        begin = time.time()
        subprocess.run([program, "batch", str(manifest), "-o", str(folder / "alone")], capture_output=True)
        print(f"one machine, no Slurm: {time.time() - begin:.0f} s")
        assert len(materials(out)) == fits and materials(out) == materials(folder / "alone")
        assert (out / "summary.csv").read_bytes() == (folder / "alone/summary.csv").read_bytes()
        print(batch(manifest, "-o", out / "../cancelled", "--slurm", "--chunk", 2), end="")
        assert "cancelled: job" in batch("cancel", out / "../cancelled")
        cluster.wait_for(lambda: not tasks(), "empty queue", 30)
    finally:
        cluster.stop()
print(f"{fits} crowns through Slurm are those of one machine, byte for byte")
