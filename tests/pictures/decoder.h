// H.264 as a viewer's decoder sees it, to compare with what was encoded.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/stream/encoder.h"

namespace gonio::test {

struct Decoded {
    int width_px = 0, height_px = 0;
    std::vector<std::uint8_t> nv12;  // as Picture::nv12
    std::int64_t number = 0;         // of the access unit that it came from: 0 is the first
    int reorder_frames = 0;          // that the stream lets a decoder hold back
    // What the stream says of its colours: codes of ITU-T H.273, 2 where it says nothing.
    int primaries = 2, transfer = 2, matrix = 2;
    bool full_range = false;
    int chroma_location = -1;  // chroma_sample_loc_type of ITU-T H.264 E.2.1; -1: nothing is said
};

// One thread.
class Decoder {
public:
    Decoder();
    ~Decoder();
    Decoder(const Decoder&) = delete;
    Decoder& operator=(const Decoder&) = delete;
    // Result: the picture of this access unit; nothing where the decoder fails or holds it back.
    std::optional<Decoded> decode(const EncodedFrame& encoded);

private:
    struct Libav;
    std::unique_ptr<Libav> libav_;
};

}  // namespace gonio::test
