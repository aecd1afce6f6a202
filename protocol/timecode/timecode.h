// Time code: labels of frames at the four rates, and the bytes of MIDI time code (MIDI 1.0 Detailed Specification,
// "MIDI Time Code"). Pure.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace gonio {

// In the order of MIDI's and Art-Net's numbers.
enum class TimecodeRate : std::uint8_t { film24, ebu25, drop30, smpte30 };

// A time of day, "HH:MM:SS:FF", whatever the rate.
struct TimecodeLabel {
    std::uint8_t hours = 0, minutes = 0, seconds = 0, frames = 0;  // 0..23, 0..59, 0..59, 0..29
    auto operator<=>(const TimecodeLabel&) const = default;
};
struct Timecode {
    TimecodeLabel label;
    TimecodeRate rate = TimecodeRate::smpte30;
    bool operator==(const Timecode&) const = default;
};

// Result: 24, 25 or 30: how many labels a second has.
unsigned frames_a_second(TimecodeRate rate);
// Result: whether the numbers are within their ranges and below the rate's frames.
bool is_timecode(const Timecode& timecode);
// Result: frames since midnight. Drop frame leaves out the labels 0 and 1 of each minute that is no tenth one; such a
// label counts as the next one there is. A frame that the rate lacks counts as the first one of the next second.
std::uint32_t frame_count(const Timecode& timecode);
// The other way; frames beyond a day begin anew.
Timecode timecode_of(std::int64_t frames, TimecodeRate rate);
// Result: real seconds since midnight; of drop frame 1001/30000 s a frame.
double seconds_of(const Timecode& timecode);

// Result: "01:02:03:04".
std::string print_timecode(const TimecodeLabel& label);
// Result: of "HH:MM:SS:FF", one or two digits each; drop frame may be written with ; before FF. Nothing where it is
// none.
std::optional<TimecodeLabel> parse_timecode(std::string_view text);

// MIDI time code among the bytes of one port.
class MtcReader {
public:
    // Result: the time now, once a full frame message or eight quarter frames in a row are complete. What quarter
    // frames say is two frames old by then, which is made up for; of a tape that runs backwards likewise.
    // A time of quarter frames counts where it goes on from the one that counted last, or from the eight right before
    // it. Its pieces are sent over two frames, and a sender that reads a running clock for each of them joins two
    // times at a roll-over: 00:01:59 between 00:00:59 and 00:01:00. The time after that contradicts it. So a real jump
    // counts with its second time. A full frame is one message and counts at once.
    std::optional<Timecode> take(std::uint8_t byte);

private:
    std::optional<Timecode> take_quarter(std::uint8_t data);
    std::optional<Timecode> take_full();
    std::optional<Timecode> confirmed(const Timecode& now);

    static constexpr std::size_t kFullBytes = 8;  // between F0 and F7
    enum class Expects : std::uint8_t { status, quarter, sysex } expects_ = Expects::status;
    std::array<std::uint8_t, kFullBytes> sysex_{};
    std::size_t sysex_bytes_ = 0;
    std::array<std::uint8_t, 8> pieces_{};
    unsigned count_ = 0;  // of pieces in a row
    bool backwards_ = false;
    std::uint8_t next_ = 0;                   // the piece that goes on
    std::optional<Timecode> counted_, said_;  // that counted last; of the last eight pieces
    std::int64_t sets_ = 0;                   // of eight pieces since counted_
};

}  // namespace gonio
