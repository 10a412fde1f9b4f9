"""How much a server takes, so that no page and no stranger can hold it up or fill its memory."""

from websockets.http11 import MAX_LINE_LENGTH

LINE = MAX_LINE_LENGTH  # bytes of a line of a request
HEAD = 16_384  # bytes of a request, which has no body
HEAD_SECONDS = 10.0  # within which a request is there as a whole
CONNECTIONS = 128  # at a time, whatever they want
PAGES = 32  # that are connected at a time
ANSWERS = 4  # that are made and sent at a time; others wait
PATIENCE = 30.0  # seconds, after which one that reads nothing, or is not heard of, is dropped
PING = 10.0  # seconds between questions whether a page is still there
LINGER = 1.0  # seconds for the other side to read what it was told last
FAREWELL = 0.5  # seconds for pages to hear that the server ends
MESSAGE = 65_536  # bytes of a message from a page
DEPTH = 16  # of arrays and objects in it
RATE = 200.0  # messages a second from a page; a drag of the pointer sends 60
BURST = 400.0  # messages that may come at once
BAD = 10  # malformed messages, after which a page is not listened to
SYSTEM = 262_144  # bytes that the system is asked to hold for a connection; they grow old there
QUEUE = 64  # messages that wait for a page
QUEUE_BYTES = 4_000_000  # of them together
