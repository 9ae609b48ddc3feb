"""A network with one far host: far.py DELAY LOSS COMMAND... runs the command where 10.78.0.2 is 10.78.0.1, far away.

Packets to 10.78.0.2 come back to 10.78.0.1 as from it, DELAY seconds later, and a fraction LOSS of them does not; so a round trip takes twice the delay.
Wants a network namespace of its own and the right to make a device in it (unshare --map-root-user --net). The status is the command's, or 77 where
there are no such devices. Which packets are lost is the same each time for the same packets.
"""
import fcntl
import heapq
import os
import random
import select
import struct
import subprocess
import sys
import time

TUNSETIFF, IFF_TUN, IFF_NO_PI = 0x400454CA, 1, 0x1000


def make_device(name):
    try:
        device = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
        fcntl.ioctl(device, TUNSETIFF, struct.pack("16sH14x", name.encode(), IFF_TUN | IFF_NO_PI))
        for command in ("link set lo up", f"addr add 10.78.0.1/24 dev {name}", f"link set {name} up"):
            subprocess.run(["ip", *command.split()], check=True)
    except (OSError, subprocess.CalledProcessError) as error:
        print(error, file=sys.stderr)
        sys.exit(77)
    return device


def returned(packet):
    """With its addresses exchanged, which leaves the sums over them as they were."""
    return packet[:12] + packet[16:20] + packet[12:16] + packet[20:]


def carry(device, delay, loss, command):
    chance = random.Random(1)
    leaving = []  # (when, count, packet)
    count = 0
    while command.poll() is None:
        wait = max(0, min(0.05, leaving[0][0] - time.monotonic())) if leaving else 0.05
        if select.select([device], [], [], wait)[0]:
            packet = os.read(device, 65536)
            if packet[0] >> 4 == 4 and chance.random() >= loss:
                count += 1
                heapq.heappush(leaving, (time.monotonic() + delay, count, returned(packet)))
        while leaving and leaving[0][0] <= time.monotonic():
            os.write(device, heapq.heappop(leaving)[2])


if __name__ == "__main__":
    tunnel = make_device("far")
    process = subprocess.Popen(sys.argv[3:])
    carry(tunnel, float(sys.argv[1]), float(sys.argv[2]), process)
    sys.exit(process.returncode)
