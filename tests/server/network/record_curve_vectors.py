#!/usr/bin/env python3
"""Records one CURVE conversation between a DEALER and a ROUTER of libzmq with fixed random numbers.

    python3 record_curve_vectors.py > curve_vectors.h

Written with libzmq 4.3.4 and libsodium 1.0.18. Nothing of oblique takes part.
"""
import ctypes as c
import hashlib
import os
import signal
import socket
import sys
import threading

DEALER, ROUTER = 5, 6
IS_CURVE_SERVER, PUBLIC, SECRET, SERVERS = 47, 48, 49, 50

sodium = c.CDLL("libsodium.so.23")
zmq = c.CDLL("libzmq.so.5")
zmq.zmq_ctx_new.restype = zmq.zmq_socket.restype = c.c_void_p
zmq.zmq_socket.argtypes = [c.c_void_p, c.c_int]
zmq.zmq_setsockopt.argtypes = [c.c_void_p, c.c_int, c.c_void_p, c.c_size_t]
zmq.zmq_bind.argtypes = zmq.zmq_connect.argtypes = [c.c_void_p, c.c_char_p]
zmq.zmq_send.argtypes = zmq.zmq_recv.argtypes = [c.c_void_p, c.c_char_p, c.c_size_t, c.c_int]


class Randomness(c.Structure):  # randombytes_implementation
    _fields_ = [("name", c.CFUNCTYPE(c.c_char_p)), ("random", c.CFUNCTYPE(c.c_uint32)),
                ("stir", c.c_void_p), ("uniform", c.c_void_p),
                ("buf", c.CFUNCTYPE(None, c.c_void_p, c.c_size_t)), ("close", c.c_void_p)]


def digest(text, size):
    return hashlib.shake_256(text.encode()).digest(size)


def fix_randomness(who, draws):
    def draw(where, size):
        draws.append(digest(f"{who} {len(draws)}", size))
        c.memmove(where, draws[-1], size)
    fixed = Randomness()
    fixed.name = Randomness._fields_[0][1](lambda: b"fixed")
    fixed.random = Randomness._fields_[1][1](lambda: 0)
    fixed.buf = Randomness._fields_[4][1](draw)
    sodium.randombytes_set_implementation(c.byref(fixed))
    return fixed


def public_half(secret):
    public = c.create_string_buffer(32)
    sodium.crypto_scalarmult_base(public, secret)
    return public.raw


def made_socket(kind, keys):
    made = zmq.zmq_socket(zmq.zmq_ctx_new(), kind)
    for option, key in keys.items():
        value = c.create_string_buffer(key, len(key))
        assert zmq.zmq_setsockopt(made, option, value, len(key)) == 0
    return made


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def serve(port, report):
    """Echoes one message in upper case and reports what was drawn."""
    draws = []
    kept = fix_randomness("server", draws)
    router = made_socket(ROUTER, {IS_CURVE_SERVER: b"\1\0\0\0", SECRET: SERVER_SECRET})
    assert zmq.zmq_bind(router, b"tcp://127.0.0.1:%d" % port) == 0
    os.write(report, b"ready\n")
    identity, body = c.create_string_buffer(64), c.create_string_buffer(64)
    size = zmq.zmq_recv(router, identity, 64, 0)
    length = zmq.zmq_recv(router, body, 64, 0)
    zmq.zmq_send(router, identity, size, 2)
    zmq.zmq_send(router, body.raw[:length].upper(), length, 0)
    os.write(report, (" ".join(draw.hex() for draw in draws) + "\n").encode())
    assert kept
    threading.Event().wait(5)
    os._exit(0)


def relay(source, target, said):
    while piece := source.recv(4096):
        said += piece
        target.sendall(piece)


def bodies_of(said):
    """Of the frames after the greeting."""
    rest, bodies = bytes(said[64:]), []
    while rest:
        header = 9 if rest[0] & 2 else 2
        end = header + int.from_bytes(rest[1:header], "big")
        bodies.append(rest[header:end])
        rest = rest[end:]
    return bodies


def show(name, data):
    text = data.hex()
    lines = [f'    "{text[i:i + 92]}"' for i in range(0, len(text), 92)]
    print(f"inline constexpr std::string_view {name} =\n" + "\n".join(lines) + ";")


FRAMES = {"Client": ("Hello", "Initiate", "Question"), "Server": ("Welcome", "Ready", "Answer")}
SERVER_SECRET, CLIENT_SECRET = digest("server's key", 32), digest("client's key", 32)


def main():
    port, (out, report) = free_port(), os.pipe()
    if (server := os.fork()) == 0:
        serve(port, report)
    drawn_by_server = os.fdopen(out)
    assert drawn_by_server.readline() == "ready\n"

    listener = socket.create_server(("127.0.0.1", 0))
    said_by_client, said_by_server, draws = bytearray(), bytearray(), []

    def proxy():
        near, _ = listener.accept()
        far = socket.create_connection(("127.0.0.1", port))
        threading.Thread(target=relay, args=(near, far, said_by_client), daemon=True).start()
        relay(far, near, said_by_server)
    threading.Thread(target=proxy, daemon=True).start()

    kept = fix_randomness("client", draws)
    dealer = made_socket(DEALER, {PUBLIC: public_half(CLIENT_SECRET), SECRET: CLIENT_SECRET,
                                  SERVERS: public_half(SERVER_SECRET)})
    zmq.zmq_connect(dealer, b"tcp://127.0.0.1:%d" % listener.getsockname()[1])
    zmq.zmq_send(dealer, b"a question", 10, 0)
    answer = c.create_string_buffer(64)
    assert zmq.zmq_recv(dealer, answer, 64, 0) == 10 and answer.value == b"A QUESTION" and kept
    _, brief, cookie_nonce, cookie_key, welcome_nonce = map(bytes.fromhex,
                                                            drawn_by_server.readline().split())
    os.kill(server, signal.SIGKILL)

    print("// A conversation of libzmq 4.3.4 with itself, recorded by record_curve_vectors.py, in hex.")
    print("#pragma once\n\n#include <string_view>\n\nnamespace oblique::server::recorded {\n")
    show("kServerSecret", SERVER_SECRET)
    show("kClientPublic", public_half(CLIENT_SECRET))
    print("\n// Random numbers of the server.")
    show("kServerBriefSecret", brief)
    show("kCookieKey", cookie_key)
    show("kCookieNonce", cookie_nonce)
    show("kWelcomeNonce", welcome_nonce)
    print("\n// Bodies of the frames of both directions.")
    for who, said in (("Client", said_by_client), ("Server", said_by_server)):
        for name, body in zip(FRAMES[who], bodies_of(said), strict=True):
            show(f"k{who}{name}", body)
    print("\n}  // namespace oblique::server::recorded")


main()
sys.stdout.flush()
os._exit(0)  # without waiting for the sockets
