"""A client that shares no code with ours: python3-websockets for the line, flatc's Python for the messages.

talk.py PORT DATASET SCHEMA: every conversation below, one after the other; status 1 and a line for each that goes otherwise than PROTOCOL.md says.
"""
import asyncio
import subprocess
import sys
import tempfile

import flatbuffers
import websockets

WINDOW = 256 << 10
ENVELOPE = 160  # of a batch's cost
PAYLOAD = 4  # the version of batches


def load_schema(schema):
    folder = tempfile.TemporaryDirectory()
    subprocess.run(["flatc", "--python", "--gen-object-api", "-o", folder.name, schema], check=True)
    sys.path.insert(0, folder.name)
    return folder


class Peer:
    def __init__(self, url, dataset):
        self.url = url
        self.dataset = dataset

    def connect(self, subprotocols=("intervale.v1",)):
        return websockets.connect(self.url, subprotocols=list(subprotocols), compression=None, max_size=1 << 20, open_timeout=20, close_timeout=20)

    @staticmethod
    def encode(kind, **fields):
        from intervale.protocol.fbs import ClientBody, ClientMessage, Credit, Lod, Open, View
        types = {"Open": Open.OpenT, "View": View.ViewT, "Credit": Credit.CreditT}
        body = types[kind]()
        for name, value in fields.items():
            setattr(body, name, value)
        if kind == "View" and body.lod is None:
            body.lod = Lod.LodT()
        message = ClientMessage.ClientMessageT()
        message.bodyType = getattr(ClientBody.ClientBody, kind)
        message.body = body
        builder = flatbuffers.Builder(256)
        builder.Finish(message.Pack(builder))
        return bytes(builder.Output())

    @staticmethod
    def decode(data):
        from intervale.protocol.fbs import ServerBody, ServerMessage
        assert isinstance(data, bytes), "text from the server"
        message = ServerMessage.ServerMessageT.InitFromObj(ServerMessage.ServerMessage.GetRootAs(data, 0))
        names = {getattr(ServerBody.ServerBody, name): name for name in ("Opened", "Batch", "Done", "Fault")}
        return names[message.bodyType], message.body

    def open(self, credit=WINDOW):
        return self.encode("Open", dataset=self.dataset, client="talk.py", credit=credit, payload=PAYLOAD)

    def view(self, epoch=1):
        return self.encode("View", epoch=epoch)

    def credit(self, size):
        return self.encode("Credit", bytes=size)

    async def receive(self, ws):
        return self.decode(await asyncio.wait_for(ws.recv(), 60))

    async def expect(self, ws, kind):
        got, body = await self.receive(ws)
        assert got == kind, f"{got} instead of {kind}: {getattr(body, 'text', '')}"
        return body

    async def expect_end(self, ws, code):
        fault = await self.expect(ws, "Fault")
        assert fault.code == code, f"a fault of code {fault.code} instead of {code}"
        try:
            await asyncio.wait_for(ws.recv(), 60)
        except websockets.ConnectionClosed as closed:
            assert closed.rcvd is not None and closed.rcvd.code == code, f"closed with {closed.rcvd} instead of {code}"
            return
        raise AssertionError(f"a message after the fault {code}")

    async def take_stream(self, ws, between=None):
        """From View to Done; what the server promises of sequence, credit and counts."""
        updates, sequence, outstanding = 0, 0, WINDOW
        while True:
            kind, body = await self.receive(ws)
            if kind == "Done":
                assert body.updatesSent == updates, f"Done says {body.updatesSent} updates, and {updates} came"
                return updates
            assert kind == "Batch", f"{kind} in a stream"
            assert body.sequence == sequence, "a batch out of sequence"
            sequence += 1
            updates += body.updates
            cost = len(body.payload) + ENVELOPE
            outstanding -= cost
            assert outstanding >= 0, "more than was granted"
            if between:
                await between(ws, sequence)
            await ws.send(self.credit(cost))
            outstanding += cost


async def confirms_the_subprotocol(peer):
    async with peer.connect(("other.v9", "intervale.v1")) as ws:
        assert ws.subprotocol == "intervale.v1", ws.subprotocol


async def refuses_an_upgrade_without_the_subprotocol(peer):
    try:
        async with peer.connect(("other.v9",)):
            pass
    except websockets.InvalidStatusCode as refused:
        assert refused.status_code == 400, refused.status_code
        return
    raise AssertionError("accepted")


async def sends_the_whole_stream(peer):
    async with peer.connect() as ws:
        await ws.send(peer.open())
        opened = await peer.expect(ws, "Opened")
        description = opened.description
        assert description.name.decode() == peer.dataset
        assert opened.payload == PAYLOAD, f"batches of version {opened.payload}"
        assert len(description.corners) == 8 and max(description.corners) <= description.last, description.corners
        levels = (max(description.dims.x, description.dims.y, description.dims.z) - 2).bit_length()
        assert len(description.weights) == 9 * max(levels, 1), f"{len(description.weights)} weights for {levels} levels"
        await ws.send(peer.view())
        updates = await peer.take_stream(ws)
        assert updates == opened.description.updates > 0, f"{updates} of {opened.description.updates} updates"


async def takes_fragments_and_answers_pings_in_the_middle(peer):
    async def between(ws, sequence):
        if sequence <= 3:
            await asyncio.wait_for(await ws.ping(b"%d" % sequence), 60)

    async def in_bytes(data):
        for byte in data:
            yield bytes([byte])
            await ws.ping()  # between the frames of one message

    async with peer.connect() as ws:
        await ws.send(in_bytes(peer.open()))
        await ws.send([peer.view()[:7], b"", peer.view()[7:]])
        await peer.expect(ws, "Opened")
        assert await peer.take_stream(ws, between) > 0


async def ends_a_text_frame_with_1003(peer):
    async with peer.connect() as ws:
        await ws.send("hello")
        await peer.expect_end(ws, 1003)


async def ends_garbage_with_4400(peer):
    for garbage in (b"", b"\xff" * 64, peer.open()[:-9], b"\x00" * 1024):
        async with peer.connect() as ws:
            await ws.send(garbage)
            await peer.expect_end(ws, 4400)


async def ends_an_unknown_data_set_with_4404(peer):
    for name in ("nowhere", "../" + peer.dataset, peer.dataset + ".ivm", ""):
        async with peer.connect() as ws:
            await ws.send(peer.encode("Open", dataset=name, client="talk.py", credit=WINDOW, payload=PAYLOAD))
            await peer.expect_end(ws, 4404)


async def ends_batches_of_another_version_with_4426(peer):
    for fields in ({}, {"payload": 1}, {"payload": PAYLOAD + 1}):
        async with peer.connect() as ws:
            await ws.send(peer.encode("Open", dataset=peer.dataset, client="talk.py", credit=WINDOW, **fields))
            await peer.expect_end(ws, 4426)


async def ends_what_is_out_of_order_with_4409(peer):
    async with peer.connect() as ws:
        await ws.send(peer.view())
        await peer.expect_end(ws, 4409)
    async with peer.connect() as ws:
        await ws.send(peer.open())
        await peer.expect(ws, "Opened")
        await ws.send(peer.open())
        await peer.expect_end(ws, 4409)


async def ends_what_is_too_large_with_4413(peer):
    async with peer.connect() as ws:
        await ws.send(peer.open(1 << 40))
        await peer.expect_end(ws, 4413)
    async with peer.connect() as ws:
        await ws.send(peer.open() + bytes(64 << 10))
        await peer.expect_end(ws, 4413)


async def ends_a_flood_of_pings_with_4413(peer):
    async with peer.connect() as ws:
        await ws.send(peer.open())
        await peer.expect(ws, "Opened")
        pongs = []
        try:
            for _ in range(100000):
                pongs.append(await ws.ping())
                await asyncio.sleep(0)
        except websockets.ConnectionClosed:
            pass
        await peer.expect_end(ws, 4413)
        await asyncio.gather(*pongs, return_exceptions=True)


async def closes_in_every_state(peer):
    async def connecting(_):
        pass

    async def opened(ws):
        await ws.send(peer.open())

    async def answered(ws):
        await opened(ws)
        await peer.expect(ws, "Opened")

    async def viewing(ws):
        await answered(ws)
        await ws.send(peer.view())

    async def streaming(ws):
        await viewing(ws)
        await peer.expect(ws, "Batch")

    async def served(ws):
        await viewing(ws)
        await peer.take_stream(ws)

    for state in (connecting, opened, answered, viewing, streaming, served):
        for code in (1000, 1001, 3456):
            async with peer.connect() as ws:
                await state(ws)
                await ws.close(code)
                assert ws.close_code == code, f"{state.__name__}: {ws.close_code} instead of {code}"


CONVERSATIONS = (confirms_the_subprotocol, refuses_an_upgrade_without_the_subprotocol, sends_the_whole_stream,
                 takes_fragments_and_answers_pings_in_the_middle, ends_a_text_frame_with_1003, ends_garbage_with_4400,
                 ends_an_unknown_data_set_with_4404, ends_batches_of_another_version_with_4426,
                 ends_what_is_out_of_order_with_4409, ends_what_is_too_large_with_4413, ends_a_flood_of_pings_with_4413, closes_in_every_state)


async def talk(peer):
    failures = 0
    for conversation in CONVERSATIONS:
        try:
            await conversation(peer)
        except Exception as error:  # any other end is a failure of that conversation
            print(f"{conversation.__name__}: {type(error).__name__}: {error}")
            failures += 1
    return failures


if __name__ == "__main__":
    port, dataset, schema = sys.argv[1:]
    generated = load_schema(schema)
    sys.exit(1 if asyncio.run(talk(Peer(f"ws://127.0.0.1:{port}/v1/stream", dataset))) else 0)
