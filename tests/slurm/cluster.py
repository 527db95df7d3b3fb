"""A SLURM cluster of one controller and two nodes on this machine, whose nodes can lose their power."""

import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shlex import quote

NODES = ("node1", "node2")
PACKAGES = ("slurmctld", "slurmd", "slurm-client", "munge")
PROGRAMS = ("slurmctld", "slurmd", "sbatch", "munged", "unshare")
DEFAULT_PLACE = Path("/etc/slurm")
FIRST_PORT, MEMORY_MB = 17817, 16000
CONF = """
ClusterName=palpate
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool_%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd_%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd_%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
SlurmdTimeout=20
MinJobAge=3600
ReturnToService=0
{nodes}
PartitionName=tests Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


ALONE = ("unshare", "--pid", "--fork", "--kill-child", "--mount", "--mount-proc")
"""Run something as the first process of a space of its own: what it starts dies with it, as when the power goes."""


def missing() -> str:
    """Why no cluster can be started here, or nothing; what is missing is installed where that can be done."""
    if os.geteuid() == 0 and subprocess.run([*ALONE, "true"], check=False, capture_output=True).returncode:
        return "nodes cannot have a space of their own here"
    if all(map(shutil.which, PROGRAMS)):
        return "" if os.geteuid() == 0 else "its daemons have to be started by root"
    if os.geteuid() != 0:
        return "SLURM is not installed, and only root could do that"
    if not shutil.which("apt-get"):
        return "SLURM is not installed, and there is no apt-get to do that"
    quiet = {"stdout": subprocess.DEVNULL, "env": os.environ | {"DEBIAN_FRONTEND": "noninteractive"}}
    for words in (["update"], ["install", "-y", "--no-install-recommends", *PACKAGES]):
        if subprocess.run(["apt-get", "-qq", *words], check=False, **quiet).returncode:
            return f"apt-get {words[0]} failed"
    return "" if all(map(shutil.which, PROGRAMS)) else "Debian's packages lack a program"


class Cluster:
    """Its daemons, which are children of this process; ``environment`` is for those who want to submit."""

    def __init__(self, folder: Path, cores: int):
        self._folder = folder
        host = os.uname().nodename
        place = f"NodeHostname={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={MEMORY_MB}"
        nodes = "\n".join(f"NodeName={n} {place} Port={port}" for port, n in enumerate(NODES, FIRST_PORT + 1))
        conf = folder / "slurm.conf"
        conf.write_text(CONF.format(host=host, port=FIRST_PORT, folder=folder, nodes=nodes))
        self.environment = os.environ | {"SLURM_CONF": str(conf)}
        self._daemons: dict[str, subprocess.Popen] = {}

    def start(self) -> None:
        """Start everything and wait until both nodes are there."""
        key = self._folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        own = [f"--{what}={self._folder}/munge.{what}" for what in ("socket", "pid-file", "log-file", "seed-file")]
        self._start("munged", ["munged", "--foreground", "--force", f"--key-file={key}", *own])
        self._until(lambda: (self._folder / "munge.socket").exists(), "munge")
        self._start("slurmctld", ["slurmctld", "-D", "-i"])
        DEFAULT_PLACE.mkdir(parents=True, exist_ok=True)
        for node in NODES:
            # its jobs are not told SLURM_CONF, so there the settings are where programs look by themselves
            settled = f"mount --bind {quote(str(self._folder))} {DEFAULT_PLACE} && exec slurmd -D -N {node}"
            self._start(node, [*ALONE, "sh", "-c", settled])
        self._until(lambda: self.tell("sinfo", "-h", "-N", "-o", "%T").split() == ["idle"] * len(NODES), "its nodes")

    def _start(self, name: str, words: list[str]) -> None:
        with open(self._folder / f"{name}.out", "w") as out:
            self._daemons[name] = subprocess.Popen(words, stdout=out, stderr=out, env=self.environment)

    def _until(self, ready, what: str) -> None:
        deadline = time.monotonic() + 60
        while not ready():
            if time.monotonic() > deadline:
                raise SystemExit(f"SLURM did not start: {what} did not answer; see {self._folder}/*.log")
            time.sleep(0.5)

    def tell(self, *words: str) -> str:
        """What a command of SLURM's prints."""
        return subprocess.run(words, env=self.environment, capture_output=True, text=True, check=False).stdout

    def cut_power(self, node: str) -> None:
        """Kill a node with all that runs on it."""
        process = self._daemons.pop(node)
        process.kill()
        process.wait()

    def stop(self) -> None:
        """End all that was started."""
        for node in set(NODES) & set(self._daemons):
            self.cut_power(node)
        for process in reversed(self._daemons.values()):
            process.send_signal(signal.SIGTERM)
        for process in self._daemons.values():
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


@contextmanager
def running(folder: Path, cores: int) -> Iterator[Cluster]:
    """A cluster whose nodes have so many ``cores`` each, with all its files in ``folder``."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "state").mkdir(parents=True)
    cluster = Cluster(folder, cores)
    try:
        cluster.start()
        yield cluster
    finally:
        cluster.stop()
