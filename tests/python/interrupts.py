"""How much of its own work a program does between an interrupt and its answer, on however busy a machine."""

import subprocess
import sys

PROGRAM = """
import signal, threading, time
signal.signal(signal.SIGINT, signal.default_int_handler)  # a child of a background job would ignore it
from concurrent.futures import ThreadPoolExecutor
import chebclear as cc

# An interrupt in the middle of an import may be lost: an interpreter ignores what its import locks and some
# extension modules raise. So the first call, which imports numpy and others, comes before.
box = {{"crank_length": cc.Interval(0.04, 0.06)}}
cc.Study(cc.mechanisms.slider_crank, box, duration=1e-6, samples=2).scan(2)

sent = []


def interrupt():
    sent.append(time.process_time())
    # To the thread that would get it from the keyboard: it may wait for another one.
    signal.pthread_kill(threading.main_thread().ident, signal.SIGINT)


threading.Timer(0.3, interrupt).start()
try:
    {call}
except KeyboardInterrupt:
    print(time.process_time() - sent[0])
"""


def work_after_interrupt(call):
    """Processor time from an interrupt of a call of `cc` to its answer, over all threads [s]."""
    program = [sys.executable, "-c", PROGRAM.format(call=call)]
    done = subprocess.run(program, capture_output=True, text=True, timeout=600.0)
    assert done.returncode == 0, done.stderr
    return float(done.stdout)
