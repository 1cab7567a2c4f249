"""A Slurm of two nodes on this machine, for tests and a benchmark.

Its daemons are real, from Debian's packages, without containers.
"""

import os
import shlex
import shutil
import signal
import socket
import subprocess
import time
from pathlib import Path

# Options for Snakemake: there is no accounting, and jobs take seconds.
SNAKEMAKE_OPTIONS = ["--profile", str(Path(__file__).resolve().parents[2] / "workflow/profiles/slurm")]
SNAKEMAKE_OPTIONS += ["--default-resources", "slurm_partition=main", "--latency-wait", "20"]
SNAKEMAKE_OPTIONS += ["--slurm-no-account", "--slurm-status-command", "squeue"]
SNAKEMAKE_OPTIONS += ["--slurm-init-seconds-before-status-checks", "3", "--seconds-between-status-checks", "3"]
PACKAGES = ["slurmctld", "slurmd", "slurm-client", "munge"]
CONF = Path("/etc/slurm/slurm.conf")
MARK = "# Written by tests/cluster/two_node_slurm.py\n"
# Nodes have one core each. Without cgroups, which a container may lack, memory limits are not enforced.
SETTINGS = """\
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort=17000
SlurmUser=root
SlurmdUser=root
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool.%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=2,batch_sched_delay=0
SlurmdParameters=config_overrides
SlurmdTimeout=10
ReturnToService=2
MinJobAge=300
AuthInfo=cred_expire=10
NodeName=n1 NodeHostname={host} NodeAddr=127.0.0.1 Port=17001 CPUs=1 RealMemory=4000
NodeName=n2 NodeHostname={host} NodeAddr=127.0.0.1 Port=17002 CPUs=1 RealMemory=4000
PartitionName=main Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
"""


class SlurmUnavailable(Exception):
    """Slurm cannot be started here; the message says why."""


class TwoNodeSlurm:
    """Starts the daemons in a folder, which stays for the logs."""

    def __init__(self, folder):
        self.folder = folder
        self.daemons = []
        self.nodes = {}
        self.settings = None

    def start(self):
        """Installs the packages, and starts the daemons. Leaves another Slurm alone."""
        if os.getuid() != 0 or not shutil.which("apt-get"):
            raise SlurmUnavailable("needs root and Debian's packages")
        if CONF.exists() and not CONF.read_text(encoding="utf-8").startswith(MARK):
            raise SlurmUnavailable(f"{CONF} is another cluster's")
        if CONF.exists() and subprocess.run(["scontrol", "ping"], capture_output=True).returncode == 0:
            raise SlurmUnavailable("another test's Slurm runs")
        if not all(map(shutil.which, ["slurmctld", "slurmd", "sbatch", "munged"])):
            install = ["apt-get", "install", "-y", "-qq", "--no-install-recommends", *PACKAGES]
            run(["apt-get", "update", "-qq"])
            run(install, env=os.environ | {"DEBIAN_FRONTEND": "noninteractive"})
        (self.folder / "state").mkdir(parents=True)
        self.settings = MARK + SETTINGS.format(host=socket.gethostname(), folder=self.folder)
        CONF.write_text(self.settings, encoding="utf-8")
        self._start_munge()
        self._start("slurmctld", "-D")
        for node in ("n1", "n2"):
            self.nodes[node] = self._start("slurmd", "-D", "-N", node)
        wait_until(lambda: nodes_that_are("idle") == 2, 60)

    def _start_munge(self):
        """The authentication that Slurm's daemons share; one that runs already serves as well."""
        if subprocess.run(["munge", "-n"], capture_output=True).returncode == 0:
            return
        for folder in ("/run/munge", "/var/log/munge", "/var/lib/munge"):
            os.makedirs(folder, exist_ok=True)
            run(["chown", "munge:", folder])
        self._start("runuser", "-u", "munge", "--", "munged", "--foreground")
        wait_until(lambda: subprocess.run(["munge", "-n"], capture_output=True).returncode == 0, 20)

    def _start(self, *command):
        """Starts a daemon in the foreground, in a process group of its own."""
        log = open(self.folder / f"{Path(command[0]).name}-{len(self.daemons)}.out", "wb")
        with log:
            daemon = subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)
        self.daemons.append(daemon)
        return daemon

    def kill_node(self, node):
        """Kills the daemon of a node, which leaves its jobs."""
        os.kill(self.nodes[node].pid, signal.SIGKILL)

    def close(self):
        """Cancels all jobs, stops the daemons and removes the configuration, if it is still the one of this object."""
        if self._is_configured():
            subprocess.run(["scancel", "--user=root"], capture_output=True)
        for daemon in reversed(self.daemons):
            if daemon.poll() is None:
                os.killpg(daemon.pid, signal.SIGTERM)
        for daemon in self.daemons:
            try:
                daemon.wait(20)
            except subprocess.TimeoutExpired:
                os.killpg(daemon.pid, signal.SIGKILL)
        if self._is_configured():
            CONF.unlink()

    def _is_configured(self):
        """Whether the machine's configuration is the one that this object wrote, with its own folder."""
        return self.settings is not None and CONF.exists() and CONF.read_text(encoding="utf-8") == self.settings


def run_in_allocation(command, nodes, log, seconds, env=None):
    """Runs a command as one job of so many nodes, and waits for its end. Returns its exit status.

    `sbatch --wait` would ask for the end every half a minute only.
    """
    ended = Path(f"{log}.status")
    script = f"{shlex.join(map(str, command))}; echo $? >{shlex.quote(str(ended))}"
    request = [f"--nodes={nodes}", "--ntasks-per-node=1", "--mem=3900", f"--output={log}"]
    run(["sbatch", *request, "--wrap", script], env=env)
    wait_until(lambda: ended.exists() and ended.read_text(encoding="utf-8").endswith("\n"), seconds)
    return int(ended.read_text(encoding="utf-8"))


def nodes_that_are(state):
    """Number of nodes in a state."""
    answer = subprocess.run(["sinfo", "-h", "-N", "-o", "%T"], capture_output=True, text=True)
    return answer.stdout.split().count(state)


def run(command, **options):
    """Runs a command that has to succeed."""
    ended = subprocess.run(command, capture_output=True, text=True, **options)
    if ended.returncode:
        raise SlurmUnavailable(f"{' '.join(command)}: {ended.stderr.strip()}")


def wait_until(is_true, seconds):
    """Waits until a condition holds."""
    end = time.monotonic() + seconds
    while not is_true():
        if time.monotonic() > end:
            raise SlurmUnavailable(f"Slurm was not ready after {seconds} s")
        time.sleep(0.5)
