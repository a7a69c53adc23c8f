"""A client of MQTT 3.1.1 for tests, as far as they need it: QoS 0, all topics, reconnection."""

import socket
import struct
import threading
import time


def text(word):
    return struct.pack(">H", len(word.encode())) + word.encode()


class Client:
    """Hears every topic of a broker on this host, in a thread of its own, and connects again whenever the broker is back.

    `on_connect()` and `on_message(topic, payload, is_retained)` are called in that thread.
    """

    def __init__(self, port, on_message, on_connect=lambda: None):
        self.port, self.on_message, self.on_connect = port, on_message, on_connect
        self.link, self.lock, self.is_over = None, threading.Lock(), False
        threading.Thread(target=self._run, daemon=True).start()

    def publish(self, topic, payload, retain=False):
        """Publishes where the broker is there; else the message is lost."""
        self._send(0x31 if retain else 0x30, text(topic) + payload.encode())

    def close(self):
        self.is_over = True
        with self.lock:
            if self.link:
                self.link.close()

    def _send(self, kind, body):
        size, length = b"", len(body)
        while True:
            length, digit = divmod(length, 128)
            size += bytes([digit | (128 if length else 0)])
            if not length:
                break
        with self.lock:
            try:
                if self.link:
                    self.link.sendall(bytes([kind]) + size + body)
            except OSError:
                pass

    def _run(self):
        while not self.is_over:
            try:
                link = socket.create_connection(("127.0.0.1", self.port), timeout=1)
                link.settimeout(None)
                self.link = link
                self._send(0x10, text("MQTT") + bytes([4, 2, 0, 0]) + text("script"))
                self._send(0x82, struct.pack(">H", 1) + text("#") + bytes([0]))
                self._hear(link.makefile("rb"))
            except OSError:
                pass
            with self.lock:
                self.link = None
            time.sleep(0.1)

    def _hear(self, stream):
        while head := stream.read(1):
            size, factor = 0, 1
            while digit := stream.read(1):
                size, factor = size + (digit[0] & 127) * factor, factor * 128
                if digit[0] < 128:
                    break
            body = stream.read(size)
            if len(body) < size:
                return
            kind = head[0] >> 4
            if kind == 2:
                self.on_connect()
            elif kind == 3:
                length = struct.unpack(">H", body[:2])[0]
                self.on_message(body[2 : 2 + length].decode(), body[2 + length :].decode(), bool(head[0] & 1))
