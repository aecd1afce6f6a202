// A surface that is a file: what a real one sent, line by line, at its times. For tests, measurements and reports of
// faults.
//
//   midi 0944:0117 nanoKONTROL2     or   hid 1209:0001 Name / 05 01 09 …   (Its report descriptor. Lines hold reports.)
//   0.0   B0 02 78
//   1.0   B0 02 79                       milliseconds since the surface came, and its bytes
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/surfaces/wire.h"

namespace gonio {

struct ReplayLine {
    std::int64_t at_ns = 0;
    std::vector<std::uint8_t> bytes;
};
struct Replay {
    FoundSurface surface;
    std::vector<ReplayLine> lines;  // ascending
};
inline constexpr std::size_t kMaxReplayLines = 1'000'000;

// Errors: "bad_surface" with the line as place; "too_large".
Result<Replay> read_replay(std::string_view text);

std::unique_ptr<Backend> make_replay_backend(Replay replay);

}  // namespace gonio
