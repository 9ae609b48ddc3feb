"""Runs every command that the documents show.

commands.py BIN: BIN is the folder of the programs. A command is a line of a fenced block marked `sh`. Each document's
commands run in order, in a temporary folder of its own, with BIN on the PATH. `intervale serve` runs in the background
until another server takes its port or the document ends. A command that cannot run here is in NOT_RUN with the reason.
Exit status 1 if a command fails, if one of NOT_RUN is in no document, or if a block has no language.
"""

import http.client
import json
import os
import re
import socket
import ssl
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = ["README.md", "server/README.md", "client/README.md", "CONTRIBUTING.md", "deploy/OPERATING.md",
             "tests/README.md"]

INSTALLS = "installs packages"
BUILDS = "builds the whole project"
RUNS_TESTS = "runs the tests, of which this is one"
NEEDS_DOCKER = "needs a docker engine and takes minutes; deploy/image tests the image, deploy/check this configuration"
NEEDS_CLUSTER = "needs a cluster; deploy/check checks this job"
NO_SUCH_HOST = "there is no such host; tests/e2e/remote_test.cpp reads files of one"
NOT_RUN = {
    "deploy/demo": "installs packages and builds; .ci/run runs it",
    "deploy/test": "installs packages and builds; this test is part of it",
    "deploy/install": INSTALLS,
    "cmake --preset release && cmake --build --preset release": BUILDS,
    "cmake --preset asan && cmake --build --preset asan": BUILDS,
    "cmake --preset asan && cmake --build --preset asan && ctest --preset asan -LE 'bench|soak'": BUILDS,
    "cmake --preset tsan && cmake --build --preset tsan --target e2e_tests": BUILDS,
    "export PATH=$PWD/build/release/bin:$PATH": "sets the PATH, which this test does too",
    "cmake --install build/release --prefix ~/.local": "writes to the home folder",
    "cmake -S client/examples -B build/examples -DCMAKE_PREFIX_PATH=$HOME/.local": "Package.Cpp does it in another folder",
    "cmake --build build/examples": "likewise",
    "python3 -m build --wheel --no-isolation client/python": "Package.Python does it with this build",
    "ctest --preset release -L unit": RUNS_TESTS,
    "ctest --preset release -L e2e": RUNS_TESTS,
    "ctest --preset release -R Front -j2": RUNS_TESTS,
    "INTERVALE_BIN=$PWD/build/release/bin ctest --preset tsan -L e2e": RUNS_TESTS,
    "ctest --preset release -R Faults -j2": RUNS_TESTS,
    "ctest --preset asan -L 'unit|e2e'": RUNS_TESTS,
    "docker build -f deploy/Dockerfile -t intervale .": NEEDS_DOCKER,
    'docker run -d --read-only --cap-drop ALL --security-opt no-new-privileges -p 8080:8080 -v "$PWD/data:/data:ro" '
    "intervale": NEEDS_DOCKER,
    'docker run -d --read-only --cap-drop ALL --security-opt no-new-privileges -p 8080:8080 -v "$PWD/data:/data:ro" \\\n'
    "    -v scratch:/var/tmp -e INTERVALE_DATA_MEMORY=2GiB intervale": NEEDS_DOCKER,
    "INTERVALE_DATA=$PWD/data docker compose -f deploy/compose.yaml up -d --build": NEEDS_DOCKER,
    "INTERVALE_DATA=$PWD/data docker compose -f deploy/compose.yaml --profile observe up -d": NEEDS_DOCKER,
    "docker compose -f deploy/compose.yaml build": NEEDS_DOCKER,
    "docker build -f deploy/mpi.Dockerfile -t intervale-mpi .": NEEDS_DOCKER,
    "sbatch --nodes=8 deploy/slurm/build.sbatch /shared/volume.nrrd /shared/every.ivm": NEEDS_CLUSTER,
    "kubectl create -k deploy/k8s/build": NEEDS_CLUSTER,
    "mpirun -n 4 intervale build volume.nrrd -o every.ivm --memory 4GiB": "needs Open MPI; tests/e2e/mpi_test.cpp runs it",
    "docker compose -f deploy/compose.yaml up -d --no-deps server-a": NEEDS_DOCKER,
    "docker compose -f deploy/compose.yaml up -d --no-deps server-b": NEEDS_DOCKER,
    "intervale serve https://data.example.org/scans/scan.ivm": NO_SUCH_HOST,
    "intervale extract https://data.example.org/scans/scan.ivm --error-percent 5 -o coarse.vtu": NO_SUCH_HOST,
    "intervale info https://data.example.org/scans/scan.ivm": NO_SUCH_HOST,
    "intervale verify https://data.example.org/scans/scan.ivm": NO_SUCH_HOST,
    "intervale serve https://scans.s3.eu-west-1.amazonaws.com/scan.ivm --aws-sign --aws-region eu-west-1": NO_SUCH_HOST,
    "intervale-client fetch https://data.example.org/scans/scan.ivm --error-percent 5 -o coarse.vtu": NO_SUCH_HOST,
    "kubectl apply -k deploy/k8s": "needs a cluster; deploy/check reads the configuration with kubectl",
}

SECONDS = 120  # for one command
PORT = re.compile(r"(?<=127\.0\.0\.1:)\d+")
SERVE = re.compile(r"\bintervale (--config \S+ )?serve\b")


def commands_of(document):
    """The commands of a document, with the number of their first line: (number, text)."""
    lines = (ROOT / document).read_text(encoding="utf-8").splitlines()
    language = None  # of the block that we are in
    commands = []
    number = 0
    while number < len(lines):
        line = lines[number]
        number += 1
        if line.startswith("```"):
            if language is None and line == "```":
                sys.exit(f"{document}:{number}: the block has no language: mark commands as sh, all else as text")
            language = line[3:] if language is None else None
            continue
        if language != "sh" or not line.strip() or line.lstrip().startswith("#"):
            continue
        first, text = number, line
        end = re.search(r"<<'?(\w+)'?", line)
        while (text.endswith("\\") or end) and number < len(lines):
            text += "\n" + lines[number]
            number += 1
            if end and lines[number - 1] == end.group(1):
                break
        commands.append((first, text))
    return commands


def without_comment(command):
    return re.sub(r"\s+# .*$", "", command)


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class Runner:
    """Runs the commands of one document in one folder."""

    def __init__(self, binaries, folder):
        self.folder = folder
        self.ports = {}  # as documented: as used here
        self.servers = {}  # by port: process
        self.environment = {k: v for k, v in os.environ.items() if not k.startswith("INTERVALE_")}
        self.environment["PATH"] = f"{binaries}{os.pathsep}{self.environment['PATH']}"

    def run(self, command):
        """Nothing, or what went wrong."""
        command = PORT.sub(lambda port: self.ports.setdefault(port.group(), str(free_port())), command)
        command = re.sub(r"--duration \d+", "--duration 1", command)  # as much is shown in a second
        if SERVE.search(command):
            return self.serve(command)
        try:
            done = subprocess.run(["bash", "-euo", "pipefail", "-c", command], cwd=self.folder, env=self.environment,
                                  stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=SECONDS)
        except subprocess.TimeoutExpired:
            return f"not done after {SECONDS} s"
        if done.returncode != 0:
            return f"status {done.returncode}: {done.stderr.strip() or done.stdout.strip()}"
        if re.search(r" --json\b", command):
            try:
                json.loads(done.stdout)
            except ValueError:
                return f"no JSON: {done.stdout[:200]}"
        return self.missing_output(command)

    def missing_output(self, command):
        for path in re.findall(r"(?: -o| --image| >>?) (\S+)", command):
            file = self.folder / path
            if not file.is_file() or file.stat().st_size == 0:
                return f"{path} was not written"
        return None

    def serve(self, command):
        configuration = re.search(r"--config (\S+)", command)
        text = command + ((self.folder / configuration.group(1)).read_text() if configuration else "")
        ports = PORT.findall(text)
        if not ports:
            return "a server without --listen 127.0.0.1:PORT would take a port that may be in use"
        if trouble := self.stop(ports[0]):
            return trouble
        log = open(self.folder / "server.log", "w+", encoding="utf-8")
        # exec: the signal is to reach the server, not the shell.
        shell = "exec " + command if not re.match(r"\w+=", command) else command
        process = subprocess.Popen(["bash", "-c", shell], cwd=self.folder, env=self.environment,
                                   stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self.servers[ports[0]] = process
        until = time.monotonic() + SECONDS
        while time.monotonic() < until and process.poll() is None:
            if is_ready(int(ports[0]), "tls-cert" in text):
                return None
            time.sleep(0.05)
        log.seek(0)
        return f"the server is not ready: {log.read()}"

    def stop(self, port):
        process = self.servers.pop(port, None)
        if process is None:
            return None
        process.terminate()
        try:
            status = process.wait(SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            return "the server did not end at SIGTERM"
        return f"the server ended with status {status}" if status != 0 else None

    def close(self):
        return [trouble for port in list(self.servers) if (trouble := self.stop(port))]


def is_ready(port, tls):
    try:
        if tls:
            context = ssl._create_unverified_context()  # the certificate is one that a command has just made
            connection = http.client.HTTPSConnection("127.0.0.1", port, timeout=5, context=context)
        else:
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
        connection.request("GET", "/readyz")
        return connection.getresponse().status == 200
    except (OSError, http.client.HTTPException):
        return False


def main():
    if len(sys.argv) != 2:
        sys.exit("usage: commands.py BIN")
    binaries = Path(sys.argv[1]).resolve()
    troubles = []
    unused = dict(NOT_RUN)
    for document in DOCUMENTS:
        with tempfile.TemporaryDirectory() as folder:
            runner = Runner(binaries, Path(folder))
            for number, command in commands_of(document):
                where = f"{document}:{number}"
                if without_comment(command) in NOT_RUN:
                    unused.pop(without_comment(command), None)
                    continue
                start = time.monotonic()
                trouble = runner.run(command)
                print(f"{where}: {time.monotonic() - start:.1f} s: {without_comment(command)}", flush=True)
                if trouble:
                    troubles.append(f"{where}: {command}\n    {trouble}")
            troubles += [f"{document}: {trouble}" for trouble in runner.close()]
    troubles += [f"NOT_RUN: no document has this command any more: {command}" for command in unused]
    for trouble in troubles:
        print(trouble, file=sys.stderr)
    sys.exit(1 if troubles else 0)


if __name__ == "__main__":
    main()
