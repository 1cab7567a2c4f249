"""Times for which Snakemake 9 and its plugin for Slurm wait, and have no setting."""

import threading


class DaemonTimer(threading.Timer):
    """A timer that the process does not wait for at its end."""

    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        self.daemon = True


def end_without_timers():
    """Snakemake starts timers with the time of max-jobs-per-timespan, and would not end before the last of them."""
    threading.Timer = DaemonTimer


def bound_status_interval(executor):
    """Makes --seconds-between-status-checks the longest time between two questions for the state of the jobs.

    After each answer that no job has ended, the plugin waits 10 seconds longer, at last 180; and the next stage of a
    capture waits as long.
    """
    interval = executor.next_seconds_between_status_checks

    def bounded(self):
        longest = self.workflow.remote_execution_settings.seconds_between_status_checks
        return min(interval.fget(self), longest)

    executor.next_seconds_between_status_checks = property(bounded, interval.fset)
