#!/usr/bin/env python3
"""What hostile clients cost an honest one: attacks on a server, and an honest client beside them.

  tests/hostile/run.py BIN [ATTACK ...] [--counts 2 20 200 20x20] [--seconds S] [--server PROGRAM]
  tests/hostile/run.py BIN ATTACK --short

BIN: the folder of the programs. ATTACK: all of them unless named; BIN/hostile_clients --list says what they do. A count is a number of attackers, from
one source address, or from so many (20x20: 20 from 20). --server: another build's `intervale`.

Prints a table. Each row has a server of its own: the honest client orbits the data set for S seconds at five views a second, and then receives the whole
stream; a crowd has gone then. The attackers run at a lower priority: elsewhere they would not take the server's processors. "cores" is processor time by time.

--short: a small data set, few attackers, and seconds of time. Exit status 1 unless the honest client gets all it asks for, its views within a generous
time, and the attackers' connections end as they should.
"""
import argparse
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

HERTZ = os.sysconf("SC_CLK_TCK")
STREAM_SECONDS = 60  # the longest that the honest client waits for the whole stream
CROWD_SECONDS = 60  # the longest that a crowd takes to come and to be let in again
WARM_UP = 1  # second, of attackers or of the honest client alone

# How the server is to end the attackers' connections in the short forms; those of other attacks it does not end.
SHORT_ENDS = {"have": {"4413"}, "slow": {"cut"}, "halfopen": {"cut"}, "crowd": {"503"}}
SHORT_OPTIONS = {"slow": ["--handshake-time", "1"], "halfopen": ["--handshake-time", "1"], "crowd": ["--max-sessions", "100"]}
SHORT_P95 = 250  # milliseconds; undisturbed it is below 5
OPTIONS = {"crowd": ["--max-memory", "100MB"]}


def cpu_seconds(pid):
    with open(f"/proc/{pid}/stat") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / HERTZ


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class Server:
    def __init__(self, program, data, options):
        port = free_port()
        self.address = f"127.0.0.1:{port}"
        self.process = subprocess.Popen([program, "serve", data, "--listen", self.address, "--log-level", "error", *options])
        until = time.monotonic() + 60
        while not self.is_ready():
            if self.process.poll() is not None or time.monotonic() > until:
                sys.exit("the server does not start")
            time.sleep(0.02)

    def is_ready(self):
        try:
            return urllib.request.urlopen(f"http://{self.address}/readyz", timeout=10).status == 200
        except (urllib.error.URLError, OSError):
            return False

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.wait()


class Honest:
    """The honest client: a view every fifth of a second, or one whole stream."""

    def __init__(self, bin, server, *options):
        command = [f"{bin}/intervale-load", f"ws://{server.address}/gyroid", "--clients", "1", "--ramp", "0", "--threads", "1", "--json", *options]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    def figures(self):
        out, err = self.process.communicate()
        figures = json.loads(out) if out else {}
        figures["trouble"] = err.strip()
        return figures


class Attackers:
    def __init__(self, bin, server, attack, count, seconds):
        attackers, _, addresses = count.partition("x")
        name = "every" if attack == "ranges" else "gyroid"
        command = ["nice", "-n", "10", f"{bin}/hostile_clients", attack, f"ws://{server.address}/{name}", "--attackers", attackers]
        command += ["--addresses", addresses or "1", "--seconds", str(seconds)]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        if self.process.stdout.readline() != "attacking\n":
            sys.exit(f"the attack {attack} does not start")

    def end(self):
        self.process.send_signal(signal.SIGTERM)
        return self.wait()

    def wait(self):
        return json.loads(self.process.communicate()[0])


def measure(options, server, attack, count):
    """The figures of one row: orbit, stream, attackers, cores. Without an attack: the honest client alone."""
    orbit_options = ["--scenario", "orbit", "--duration", str(options.seconds)]
    longest = options.seconds + STREAM_SECONDS + 60
    honest = attackers = None
    if attack == "crowd":  # it turns away who comes then
        honest = Honest(options.bin, server, *orbit_options)
        time.sleep(WARM_UP)
    if attack:
        attackers = Attackers(options.bin, server, attack, count, CROWD_SECONDS if attack == "crowd" else longest)
    if not honest:
        time.sleep(WARM_UP)
        honest = Honest(options.bin, server, *orbit_options)
    pids = [process.pid for process in (server.process, attackers and attackers.process) if process]
    start, before = time.monotonic(), [cpu_seconds(pid) for pid in pids]
    orbit = honest.figures()
    cores = [(cpu_seconds(pid) - b) / (time.monotonic() - start) for pid, b in zip(pids, before)]
    seen = attackers.wait() if attack == "crowd" else {}
    stream = Honest(options.bin, server, "--scenario", "full", "--duration", str(STREAM_SECONDS)).figures()
    if attack and not seen:
        seen = attackers.end()
    return {"orbit": orbit, "stream": stream, "seen": seen, "cores": cores}


def make_data(options, folder):
    program = f"{options.bin}/intervale"
    size = "33" if options.short else "257"
    small = "33" if options.short else "129"

    def run(*command):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)

    run(program, "sample", "gyroid", "--size", size, "-o", f"{folder}/gyroid.nrrd")
    run(program, "build", f"{folder}/gyroid.nrrd", "-o", f"{folder}/data/gyroid.ivm", "--range", "-0.5", "0.5")
    if "ranges" in options.attacks:
        run(program, "sample", "gyroid", "--size", small, "-o", f"{folder}/every.nrrd")
        run(program, "build", f"{folder}/every.nrrd", "-o", f"{folder}/data/every.ivm")


def milliseconds(value):
    return "none" if value is None else f"{value:.0f} ms" if value >= 10 else f"{value:.1f} ms"


def print_row(name, count, figures, quiet_seconds):
    orbit, stream, seen = (figures[part] for part in ("orbit", "stream", "seen"))
    views, first = orbit.get("view_change_ms", {}), orbit.get("first_mesh_ms", {})
    done = "never" if not stream.get("complete") else f"{stream['seconds']:.1f} s"
    if stream.get("complete") and quiet_seconds:
        done += f" (× {stream['seconds'] / quiet_seconds:.1f})"
    ends = ", ".join(f"{end} × {times}" for end, times in seen.get("ends", {}).items())
    if name == "crowd" and ends:
        ends += "; not let in again" if seen["let_in_ms"] is None else f"; let in again after {milliseconds(seen['let_in_ms'])}"
    cores = [f"{share:.2f}" for share in figures["cores"]]
    columns = [name, count, milliseconds(views.get("p50")), milliseconds(views.get("p95")), milliseconds(first.get("p50")), done, ends or "none", *cores]
    print("| " + " | ".join(columns) + " |", flush=True)
    for part in (orbit, stream):
        if part["trouble"]:
            print(f"{name}, {count}: {part['trouble']}", file=sys.stderr)


def troubles_of(attack, figures):
    """What a short form asks for and did not find."""
    orbit, stream, seen = (figures[part] for part in ("orbit", "stream", "seen"))
    troubles = [part["trouble"] for part in (orbit, stream) if part["trouble"]]
    if not stream.get("complete"):
        troubles.append("the honest stream was not received as a whole")
    p95 = orbit.get("view_change_ms", {}).get("p95")
    if p95 is None or p95 > SHORT_P95:
        troubles.append(f"95 % of the honest views were answered within {p95} ms, and {SHORT_P95} are wanted")
    if set(seen["ends"]) != SHORT_ENDS.get(attack, set()):
        troubles.append(f"the server ended connections with {seen['ends']}")
    if seen["messages"] == 0 and attack != "halfopen":
        troubles.append("the attackers sent nothing")
    if attack == "crowd" and (seen["let_in_ms"] is None or seen["let_in_ms"] > 1000):
        troubles.append(f"a new session was let in after {seen['let_in_ms']} ms")
    return troubles


def run_short(options, data):
    status = 0
    for attack in options.attacks:
        with Server(options.server, data, SHORT_OPTIONS.get(attack, [])) as server:
            for trouble in troubles_of(attack, measure(options, server, attack, "2x2")):
                print(f"{attack}: {trouble}", file=sys.stderr)
                status = 1
    return status


def run_all(options, data):
    print("| attack | attackers | views p50 | p95 | first mesh | whole stream | how their connections ended | server, cores | attackers, cores |")
    print("|---|---|---|---|---|---|---|---|---|")
    with Server(options.server, data, []) as server:
        quiet = measure(options, server, None, None)
        print_row("none", "0", {**quiet, "cores": [*quiet["cores"], 0]}, None)
    for attack in options.attacks:
        for count in options.counts:
            with Server(options.server, data, OPTIONS.get(attack, [])) as server:
                print_row(attack, count.replace("x", " from "), measure(options, server, attack, count), quiet["stream"].get("seconds"))
    return 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin")
    parser.add_argument("attacks", nargs="*", metavar="ATTACK")
    parser.add_argument("--counts", nargs="+", default=["2", "20", "200", "20x20"])
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--server")
    parser.add_argument("--short", action="store_true")
    options = parser.parse_args()
    options.server = options.server or f"{options.bin}/intervale"
    options.seconds = options.seconds or (2 if options.short else 8)
    if not options.attacks:
        listed = subprocess.run([f"{options.bin}/hostile_clients", "--list"], check=True, capture_output=True, text=True).stdout
        options.attacks = [line.split()[0] for line in listed.splitlines()]
    with tempfile.TemporaryDirectory() as folder:
        os.mkdir(f"{folder}/data")
        make_data(options, folder)
        return run_short(options, f"{folder}/data") if options.short else run_all(options, f"{folder}/data")


if __name__ == "__main__":
    sys.exit(main())
