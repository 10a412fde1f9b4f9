"""Limits of a server, so that a client cannot block it or fill its memory."""

from websockets.http11 import MAX_LINE_LENGTH

LINE = MAX_LINE_LENGTH  # length of a line of a request, bytes
HEAD = 16_384  # size of a request, bytes; requests have no body
HEAD_SECONDS = 10.0  # time for a complete request
CONNECTIONS = 128  # simultaneous connections
PAGES = 32  # simultaneously connected pages
ANSWERS = 4  # responses that are prepared simultaneously; others wait
PATIENCE = 30.0  # seconds until a client that neither reads nor sends is disconnected
PING = 10.0  # seconds between pings
LINGER = 1.0  # seconds for a client to read the last response
FAREWELL = 0.5  # seconds for closing the connections of pages
MESSAGE = 65_536  # size of a message from a page, bytes
DEPTH = 16  # depth of arrays and objects in a message
RATE = 200.0  # messages a second from a page; a drag of the pointer sends 60
BURST = 400.0  # messages from a page at once
BAD = 10  # malformed messages until the page is disconnected
SYSTEM = 262_144  # send buffer of the system for a connection, bytes
QUEUE = 64  # waiting messages of a page
QUEUE_BYTES = 4_000_000  # size of these messages
