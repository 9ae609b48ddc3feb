#!/usr/bin/env python3
"""A server under clients that come, move and go, for long: whether it grows, forgets to let go, or sends a wrong mesh.

  tests/soak/soak.py BIN [MINUTES]      BIN: the programs' folder; MINUTES: 30 otherwise

Fails unless all of it holds: no mesh is wrong and no client fails; resident memory at the end is at most 1.05 times what it was after the first sixth of
the time (five minutes of thirty); in the end there are no sessions, and as many open descriptors as before the first client.
"""
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

MOST_GROWTH = 1.05
AT_ONCE = 2  # harnesses
PATIENCE = 30  # seconds, for the last sessions to end


def metric(address, name):
    text = urllib.request.urlopen(f"http://{address}/metrics", timeout=10).read().decode()
    return float(re.search(rf"^intervale_{name} (\S+)$", text, re.M).group(1))


def descriptors(server):
    return len(os.listdir(f"/proc/{server.pid}/fd"))


def start_server(bin, data, log):
    server = subprocess.Popen([f"{bin}/intervale", "serve", data, "--listen", "127.0.0.1:0", "--log-level", "warn"], stderr=open(log, "w"))
    # The address is not logged at this level: it is what the server listens at.
    while True:
        time.sleep(0.1)
        found = subprocess.run(["ss", "-ltnpH"], capture_output=True, text=True).stdout
        at = re.search(rf"(127\.0\.0\.1:\d+) .*pid={server.pid},", found)
        if not at:
            continue
        try:
            urllib.request.urlopen(f"http://{at.group(1)}/readyz", timeout=10)
            return server, at.group(1)
        except urllib.error.HTTPError:
            pass  # not ready yet


def start_clients(bin, address, seed):
    choice = random.Random(seed)
    scenario = choice.choice(["full", "orbit", "zoom", "jump", "range"])
    name = "every" if scenario == "range" else choice.choice(["buckyball", "gyroid"])
    command = [f"{bin}/intervale-load", f"ws://{address}/{name}", "--scenario", scenario, "--seed", str(seed), "--json"]
    command += ["--clients", str(choice.randint(1, 12)), "--duration", str(choice.randint(3, 20)), "--verify"]
    if scenario != "full" and choice.random() < 0.5:
        command += ["--max-tets", str(choice.choice([5000, 50000]))]
    if scenario == "jump" and choice.random() < 0.5:
        command += ["--max-kept", str(choice.choice([5000, 20000]))]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def main():
    bin, minutes = sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 30
    with tempfile.TemporaryDirectory() as data:
        for name, size, low, high in [("buckyball", 97, 128, 188), ("gyroid", 65, -0.4, 0.4)]:
            subprocess.run([f"{bin}/intervale", "sample", name, "--size", str(size), "-o", f"{data}/{name}.nrrd"], check=True, stdout=subprocess.DEVNULL)
            built = [f"{bin}/intervale", "build", f"{data}/{name}.nrrd", "-o", f"{data}/{name}.ivm", "--range", str(low), str(high)]
            subprocess.run(built, check=True, stdout=subprocess.DEVNULL)
        every = [f"{bin}/intervale", "build", f"{data}/gyroid.nrrd", "-o", f"{data}/every.ivm"]
        subprocess.run(every, check=True, stdout=subprocess.DEVNULL)
        server, address = start_server(bin, data, f"{data}/log")
        try:
            return soak(bin, server, address, minutes)
        finally:
            server.send_signal(signal.SIGTERM)
            server.wait()


def soak(bin, server, address, minutes):
    descriptors_before = descriptors(server)
    start = time.monotonic()
    early = None
    most = 0
    seed = runs = clients = verified = 0
    wrong = []
    running = []
    while time.monotonic() < start + 60 * minutes or running:
        if len(running) < AT_ONCE and time.monotonic() < start + 60 * minutes:
            seed += 1
            running.append(start_clients(bin, address, seed))
        time.sleep(0.5)
        most = max(most, metric(address, "resident_memory_bytes"))
        if early is None and time.monotonic() > start + 10 * minutes:
            early = metric(address, "resident_memory_bytes")
        for harness in [h for h in running if h.poll() is not None]:
            running.remove(harness)
            out, err = harness.communicate()
            figures = json.loads(out) if out else {}
            runs += 1
            clients += figures.get("clients", 0)
            verified += figures.get("verified", 0)
            if harness.returncode != 0:
                wrong.append(f"{' '.join(harness.args)}: {err.strip()[-300:]}")
    deadline = time.monotonic() + PATIENCE
    while (metric(address, "sessions") > 0 or descriptors(server) > descriptors_before) and time.monotonic() < deadline:
        time.sleep(0.2)
    late = metric(address, "resident_memory_bytes")
    rows = [
        ("minutes", f"{minutes:g}"),
        ("harnesses, clients, meshes compared", f"{runs}, {clients}, {verified}"),
        ("updates sent", f"{metric(address, 'updates_sent_total'):,.0f}"),
        ("failed harnesses", str(len(wrong))),
        ("resident after a sixth, at most, at the end", f"{early / 1e6:.1f}, {most / 1e6:.1f}, {late / 1e6:.1f} MB ({late / early:.3f} times)"),
        ("sessions at the end", f"{metric(address, 'sessions'):.0f}"),
        ("descriptors before and at the end", f"{descriptors_before}, {descriptors(server)}"),
    ]
    for row in rows:
        print("| " + " | ".join(row) + " |")
    for line in wrong:
        print(line, file=sys.stderr)
    good = not wrong and late <= MOST_GROWTH * early and metric(address, "sessions") == 0 and descriptors(server) <= descriptors_before
    return 0 if good else 1


sys.exit(main())
