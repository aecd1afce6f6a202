#include "protocol/timecode/timecode.h"

#include <algorithm>
#include <charconv>
#include <cstdio>

namespace gonio {
namespace {

constexpr unsigned kMinutesADay = 24 * 60;
constexpr std::int64_t kFramesASet = 2;  // that eight quarter frames take
constexpr std::int64_t kSlack = 2;       // frames that a sender's clock may be off from one time to the next

std::uint32_t frames_a_day(TimecodeRate rate) {
    const std::uint32_t labels = kMinutesADay * 60 * frames_a_second(rate);
    return rate == TimecodeRate::drop30 ? labels - 2 * (kMinutesADay - kMinutesADay / 10) : labels;
}

// Result: whether `now` is about `frames` after `before`; midnight is no end.
bool follows(const std::optional<Timecode>& before, const Timecode& now, std::int64_t frames) {
    if (!before || before->rate != now.rate) return false;
    const std::int64_t day = frames_a_day(now.rate);
    const std::int64_t from = frame_count(*before), to = frame_count(now);
    const std::int64_t off = ((to - from - frames + kSlack) % day + day) % day;
    return off <= 2 * kSlack;
}

}  // namespace

unsigned frames_a_second(TimecodeRate rate) {
    return rate == TimecodeRate::film24 ? 24 : rate == TimecodeRate::ebu25 ? 25 : 30;
}

bool is_timecode(const Timecode& timecode) {
    const TimecodeLabel& label = timecode.label;
    return label.hours < 24 && label.minutes < 60 && label.seconds < 60 &&
           label.frames < frames_a_second(timecode.rate);
}

std::uint32_t frame_count(const Timecode& timecode) {
    const TimecodeLabel& label = timecode.label;
    const std::uint32_t rate = frames_a_second(timecode.rate);
    const std::uint32_t minutes = label.hours * 60u + label.minutes;
    std::uint32_t frames = std::min<std::uint32_t>(label.frames, rate);
    if (timecode.rate != TimecodeRate::drop30) return (minutes * 60 + label.seconds) * rate + frames;
    const bool drops = label.minutes % 10 != 0 && label.seconds == 0;
    if (drops) frames = std::max<std::uint32_t>(frames, 2);
    return (minutes * 60 + label.seconds) * rate + frames - 2 * (minutes - minutes / 10);
}

Timecode timecode_of(std::int64_t frames, TimecodeRate rate) {
    const std::int64_t day = frames_a_day(rate);
    std::int64_t labels = (frames % day + day) % day;
    if (rate == TimecodeRate::drop30) {
        constexpr std::int64_t kTen = 10 * 60 * 30 - 9 * 2, kMinute = 60 * 30 - 2;  // frames of ten minutes, of one
        const std::int64_t tens = labels / kTen, rest = labels % kTen;
        labels += 18 * tens;
        if (rest >= 2) labels += 2 * ((rest - 2) / kMinute);
    }
    const std::int64_t a_second = frames_a_second(rate);
    const std::int64_t seconds = labels / a_second;
    Timecode timecode;
    timecode.rate = rate;
    timecode.label = {static_cast<std::uint8_t>(seconds / 3600), static_cast<std::uint8_t>(seconds / 60 % 60),
                      static_cast<std::uint8_t>(seconds % 60), static_cast<std::uint8_t>(labels % a_second)};
    return timecode;
}

double seconds_of(const Timecode& timecode) {
    const double frames = frame_count(timecode);
    return timecode.rate == TimecodeRate::drop30 ? frames * 1001.0 / 30000.0 : frames / frames_a_second(timecode.rate);
}

std::string print_timecode(const TimecodeLabel& label) {
    char text[16];
    std::snprintf(text, sizeof text, "%02u:%02u:%02u:%02u", label.hours, label.minutes, label.seconds, label.frames);
    return text;
}

std::optional<TimecodeLabel> parse_timecode(std::string_view text) {
    TimecodeLabel label;
    std::uint8_t* const parts[] = {&label.hours, &label.minutes, &label.seconds, &label.frames};
    constexpr unsigned kMost[] = {23, 59, 59, 29};
    for (std::size_t i = 0; i < 4; ++i) {
        unsigned value = 0;
        const auto [end, error] =
            std::from_chars(text.data(), text.data() + std::min<std::size_t>(2, text.size()), value);
        if (error != std::errc() || value > kMost[i]) return std::nullopt;
        text.remove_prefix(static_cast<std::size_t>(end - text.data()));
        *parts[i] = static_cast<std::uint8_t>(value);
        if (i == 3) break;
        if (!(text.starts_with(':') || (i == 2 && text.starts_with(';')))) return std::nullopt;
        text.remove_prefix(1);
    }
    return text.empty() ? std::optional(label) : std::nullopt;
}

std::optional<Timecode> MtcReader::take(std::uint8_t byte) {
    if (byte >= 0xF8) return std::nullopt;  // real-time: may stand inside any message
    if (byte >= 0x80) {
        const bool ends = byte == 0xF7 && expects_ == Expects::sysex && sysex_bytes_ == kFullBytes;
        expects_ = byte == 0xF0 ? Expects::sysex : byte == 0xF1 ? Expects::quarter : Expects::status;
        sysex_bytes_ = 0;
        return ends ? take_full() : std::nullopt;
    }
    if (expects_ == Expects::quarter) {
        expects_ = Expects::status;
        return take_quarter(byte);
    }
    if (expects_ != Expects::sysex) return std::nullopt;
    if (sysex_bytes_ == kFullBytes)
        expects_ = Expects::status;  // longer than a full frame: another one
    else
        sysex_[sysex_bytes_++] = byte;
    return std::nullopt;
}

// 0mmmdddd: the pieces 0 to 7 are frames, seconds, minutes and hours, the lower four bits of each first.
std::optional<Timecode> MtcReader::take_quarter(std::uint8_t data) {
    const std::uint8_t piece = data >> 4;
    if (count_ == 0 || piece != next_) {
        count_ = 0;
        if (piece != 0 && piece != 7) return std::nullopt;
        backwards_ = piece == 7;
    }
    pieces_[piece] = data & 0x0F;
    ++count_;
    next_ = static_cast<std::uint8_t>((backwards_ ? piece + 7 : piece + 1) % 8);
    if (count_ < 8) return std::nullopt;
    count_ = 0;
    const auto joined = [&](std::size_t low) {
        return static_cast<std::uint8_t>(pieces_[low] | pieces_[low + 1] << 4);
    };
    Timecode timecode;
    timecode.label = {static_cast<std::uint8_t>(joined(6) & 0x1F), joined(4), joined(2), joined(0)};
    timecode.rate = static_cast<TimecodeRate>(pieces_[7] >> 1 & 3);
    const std::int64_t step = backwards_ ? -kFramesASet : kFramesASet;
    ++sets_;
    if (!is_timecode(timecode)) return std::nullopt;
    return confirmed(timecode_of(static_cast<std::int64_t>(frame_count(timecode)) + step, timecode.rate));
}

// Of quarter frames: what goes on from nothing that is known is only remembered.
std::optional<Timecode> MtcReader::confirmed(const Timecode& now) {
    const std::int64_t step = backwards_ ? -kFramesASet : kFramesASet;
    const bool counts = follows(counted_, now, sets_ * step) || follows(said_, now, step);
    said_ = now;
    if (!counts) return std::nullopt;
    counted_ = now;
    sets_ = 0;
    return now;
}

// 7F dev 01 01 hh mm ss ff
std::optional<Timecode> MtcReader::take_full() {
    if (sysex_[0] != 0x7F || sysex_[2] != 0x01 || sysex_[3] != 0x01) return std::nullopt;
    Timecode timecode;
    timecode.label = {static_cast<std::uint8_t>(sysex_[4] & 0x1F), sysex_[5], sysex_[6], sysex_[7]};
    timecode.rate = static_cast<TimecodeRate>(sysex_[4] >> 5 & 3);
    if (!is_timecode(timecode)) return std::nullopt;
    counted_ = said_ = timecode;
    sets_ = 0;
    return timecode;
}

}  // namespace gonio
