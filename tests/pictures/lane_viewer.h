// A viewer of a lane on the same machine: the server's own encoder and repeats, and a decoder that acknowledges at
// once.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/stream/encoder.h"

namespace gonio::test {

class LaneViewer {
public:
    LaneViewer();
    ~LaneViewer();
    LaneViewer(const LaneViewer&) = delete;
    LaneViewer& operator=(const LaneViewer&) = delete;

    struct Received {
        std::vector<std::uint8_t> nv12;  // as decoded
        std::size_t bytes = 0;
        double encode_ms = 0.0;
        bool key = false, final = false;
    };
    // A new picture, at `now_ns` of a clock that the caller counts.
    void show(gonio::Picture picture, std::int64_t now_ns);
    // The lane is served, and its encoder waited for. settled: no newer picture will come. Result: the frame that came,
    // if one did. Throws std::runtime_error where it cannot be decoded.
    std::optional<Received> serve(std::int64_t now_ns, bool settled);
    const gonio::Picture& newest() const;

private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace gonio::test
