// The MJPEG stream read with fetch(): an <img> cannot send a token, and a token belongs into no address.

const kBoundary = new TextEncoder().encode("\r\n--gonio-frame\r\n");
const kHeaderEnd = new TextEncoder().encode("\r\n\r\n");
const kMaxPartBytes = 64 << 20;

// Result: where `what` begins in `bytes` at or after `from`, or -1.
function find(bytes, what, from) {
    for (let at = bytes.indexOf(what[0], from); at >= 0; at = bytes.indexOf(what[0], at + 1)) {
        if (at + what.length > bytes.length) return -1;
        let same = 1;
        while (same < what.length && bytes[at + same] === what[same]) same++;
        if (same === what.length) return at;
    }
    return -1;
}

// Cuts a stream of bytes into its JPEG files. Each is complete when the next part's boundary has come, which the server
// sends right behind it.
export class PartReader {
    #bytes = kBoundary.slice(0, 2);    // the first boundary has no line before it
    #searched = 0;

    // Result: the files that are complete now.
    take(chunk) {
        const joined = new Uint8Array(this.#bytes.length + chunk.length);
        joined.set(this.#bytes);
        joined.set(chunk, this.#bytes.length);
        const files = [];
        let begin = 0;
        for (;;) {
            const end = find(joined, kBoundary, Math.max(begin, this.#searched));
            if (end < 0) break;
            const header = find(joined, kHeaderEnd, begin);
            if (header >= 0 && header + kHeaderEnd.length < end) files.push(joined.slice(header + kHeaderEnd.length, end));
            begin = end + kBoundary.length;
            this.#searched = begin;
        }
        this.#bytes = joined.slice(begin);
        this.#searched = Math.max(0, this.#bytes.length - kBoundary.length);
        if (this.#bytes.length > kMaxPartBytes) throw new RangeError("a part of the stream does not end");
        return files;
    }
}

// Shows the stream in the <img> until stop(); fires its "error" event where the stream ends by itself.
export class MjpegStream {
    #image;
    #abort = null;

    constructor(image) { this.#image = image; }

    async start(token) {
        this.stop();
        const abort = this.#abort = new AbortController();
        try {
            const response = await fetch("/v1/mjpeg", {
                cache: "no-store", signal: abort.signal, headers: {Authorization: `Bearer ${token}`},
            });
            if (!response.ok) throw new Error(`HTTP ${response.status}`);
            const parts = new PartReader();
            for (const reader = response.body.getReader(); ;) {
                const {done, value} = await reader.read();
                if (done) break;
                const files = parts.take(value);
                if (files.length && !abort.signal.aborted) this.#show(files.at(-1));    // older ones are late already
            }
        } catch {
            // The end of the stream is told below, however it came.
        }
        if (!abort.signal.aborted) this.#image.dispatchEvent(new Event("error"));
    }

    stop() {
        this.#abort?.abort();
        this.#abort = null;
    }

    #show(file) {
        const old = this.#image.src;
        this.#image.src = URL.createObjectURL(new Blob([file], {type: "image/jpeg"}));
        if (old.startsWith("blob:")) URL.revokeObjectURL(old);
    }
}
