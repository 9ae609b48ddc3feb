#!/usr/bin/env python3
"""What TLS and logs cost a server: the same whole streams from servers in turns, and the processor time that each took for them.

  tests/bench/serving.py BIN [--runs N] [--clients N] [--size N] [--before BIN]

BIN: the programs' folder. --before: another version's, for one more row. Prints a table for RESULTS.md. Wants openssl for a certificate.
"""
import argparse
import json
import os
import re
import ssl
import statistics
import subprocess
import tempfile
import urllib.error
import urllib.request

HERTZ = os.sysconf("SC_CLK_TCK")


class Server:
    def __init__(self, program, data, *options, log="info"):
        command = [program, "serve", data, "--listen", "127.0.0.1:0", "--log-level", log, *options]
        self.scheme = "wss" if "--tls-cert" in options else "ws"
        self.process = subprocess.Popen(command, stderr=open(f"{data}.log", "a"))
        self.port = None
        while self.port is None:
            found = subprocess.run(["ss", "-ltnpH"], capture_output=True, text=True).stdout
            at = re.search(rf"127\.0\.0\.1:(\d+) .*pid={self.process.pid},", found)
            self.port = int(at.group(1)) if at else None
        while not self.is_ready():
            pass

    def is_ready(self):
        try:
            url = f"http{'s' if self.scheme == 'wss' else ''}://127.0.0.1:{self.port}/readyz"
            return urllib.request.urlopen(url, timeout=10, context=ssl._create_unverified_context()).status == 200
        except urllib.error.HTTPError:
            return False

    def cpu(self):
        with open(f"/proc/{self.process.pid}/stat") as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / HERTZ

    def serve(self, load, name, clients):
        before = self.cpu()
        command = [load, f"{self.scheme}://127.0.0.1:{self.port}/{name}", "--scenario", "full", "--clients", str(clients), "--ramp", "0", "--duration", "120", "--json"]
        environment = dict(os.environ, INTERVALE_CA=certificate) if self.scheme == "wss" else None
        figures = json.loads(subprocess.run(command, check=True, capture_output=True, text=True, env=environment).stdout)
        return self.cpu() - before, figures["updates_per_s"], figures["updates"] / clients


parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("bin")
parser.add_argument("--runs", type=int, default=5)
parser.add_argument("--clients", type=int, default=40)
parser.add_argument("--size", type=int, default=257)
parser.add_argument("--before")
options = parser.parse_args()

with tempfile.TemporaryDirectory() as folder:
    volume, data = f"{folder}/volume.nrrd", f"{folder}/buckyball.ivm"
    certificate, key = f"{folder}/certificate.pem", f"{folder}/key.pem"
    run = lambda *command: subprocess.run(command, check=True, capture_output=True)
    run(f"{options.bin}/intervale", "sample", "buckyball", "--size", str(options.size), "-o", volume)
    run(f"{options.bin}/intervale", "build", volume, "-o", data, "--range", "128", "188")
    run("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-keyout", key, "-out", certificate, "-days", "2",
        "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1")
    program = f"{options.bin}/intervale"
    servers = {
        "plain, logs at info": Server(program, data),
        "plain, logs off": Server(program, data, log="off"),
        "TLS 1.3, logs at info": Server(program, data, "--tls-cert", certificate, "--tls-key", key),
    }
    if options.before:
        servers["before"] = Server(f"{options.before}/intervale", data)
    times = {name: [] for name in servers}
    speeds = {name: [] for name in servers}
    try:
        for _ in range(options.runs):
            for name, server in servers.items():
                time, speed, updates = server.serve(f"{options.bin}/intervale-load", "buckyball", options.clients)
                times[name].append(time)
                speeds[name].append(speed)
    finally:
        for server in servers.values():
            server.process.kill()
    first = next(iter(servers))
    print(f"{options.clients} clients at once, each receiving the whole stream of {updates:,.0f} updates; {options.runs} rounds, the servers in turn; median\n(least, greatest). The processor time is the server's.\n")
    print("| server | CPU s | relative to the first | updates a second | relative to the first |\n|---|---|---|---|---|")
    for name in servers:
        time, speed = times[name], speeds[name]
        ratios = [statistics.median(a / b for a, b in zip(these[name], these[first])) for these in (times, speeds)]
        print(f"| {name} | {statistics.median(time):.2f} ({min(time):.2f}, {max(time):.2f}) | {ratios[0]:.2f} | {statistics.median(speed) / 1e6:.2f} M | {ratios[1]:.2f} |")
