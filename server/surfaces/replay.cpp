#include "server/surfaces/replay.h"

#include <charconv>
#include <cstdio>

#include "protocol/text/text_bytes.h"

namespace gonio {
namespace {

Error bad(std::size_t line, std::string_view text, const char* why) {
    return {"bad_surface", "line " + std::to_string(line), shown_text(text), why};
}

// Hexadecimal bytes with spaces between; nothing else.
bool read_bytes(std::string_view text, std::vector<std::uint8_t>& bytes) {
    while (!text.empty()) {
        if (text.front() == ' ') {
            text.remove_prefix(1);
            continue;
        }
        std::uint8_t byte = 0;
        if (text.size() < 2 || std::from_chars(text.data(), text.data() + 2, byte, 16).ptr != text.data() + 2)
            return false;
        bytes.push_back(byte);
        text.remove_prefix(2);
        if (!text.empty() && text.front() != ' ') return false;
    }
    return true;
}

bool read_head(std::string_view line, FoundSurface& surface) {
    unsigned vendor = 0, product = 0;
    int used = 0;
    char kind[8] = "";
    const std::string text(line.substr(0, 256));
    if (std::sscanf(text.c_str(), "%7s %4x:%4x %n", kind, &vendor, &product, &used) < 3) return false;
    const std::string name = kind;
    if (name != "midi" && name != "hid") return false;
    std::string_view rest = line.substr(std::min<std::size_t>(static_cast<std::size_t>(used), line.size()));
    const std::size_t slash = rest.find(" / ");
    if (slash != rest.npos && !read_bytes(rest.substr(slash + 3), surface.descriptor)) return false;
    surface.product = shown_text(rest.substr(0, slash), 64);
    surface.vendor_id = static_cast<std::uint16_t>(vendor);
    surface.product_id = static_cast<std::uint16_t>(product);
    surface.identity = surface_identity(surface.vendor_id, surface.product_id, "", "replay");
    surface.path = "replay " + name;
    surface.transport = "replay";
    surface.owned = true;
    return true;
}

class ReplayBackend final : public Backend {
public:
    explicit ReplayBackend(Replay replay) : replay_(std::move(replay)) {}
    std::vector<FoundSurface> scan() override { return {replay_.surface}; }
    Result<std::unique_ptr<Wire>> open(const FoundSurface&, WireEvents events) override {
        events_ = std::move(events);
        began_ns_ = monotonic_ns();
        next_ = 0;
        return std::unique_ptr<Wire>(std::make_unique<Deaf>());
    }
    std::int64_t due_ns() const override {
        return began_ns_ == 0 || next_ == replay_.lines.size() ? 0 : began_ns_ + replay_.lines[next_].at_ns;
    }
    void serve() override {
        const std::int64_t now_ns = monotonic_ns();
        for (; began_ns_ != 0 && next_ < replay_.lines.size() && due_ns() <= now_ns; ++next_) {
            const ReplayLine& line = replay_.lines[next_];
            if (replay_.surface.path == "replay hid") {
                events_.report(line.bytes, due_ns());
                continue;
            }
            std::vector<MidiMessage> messages;
            const std::size_t skipped = stream_.take(line.bytes, messages);
            events_.midi(messages, skipped, due_ns());
            if (MidiNews news = stream_.take_news(); !news.empty()) events_.system(std::move(news), due_ns());
        }
    }

private:
    class Deaf final : public Wire {
        bool write(std::uint8_t, Bytes) override { return true; }
    };
    Replay replay_;
    WireEvents events_;
    MidiStream stream_;
    std::int64_t began_ns_ = 0;
    std::size_t next_ = 0;
};

}  // namespace

Result<Replay> read_replay(std::string_view text) {
    Replay replay;
    std::size_t number = 0;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        ++number;
        line = line.substr(0, line.find('#'));
        while (line.ends_with(' ') || line.ends_with('\r')) line.remove_suffix(1);
        while (line.starts_with(' ')) line.remove_prefix(1);
        if (line.empty()) continue;
        if (replay.surface.path.empty()) {
            if (!read_head(line, replay.surface))
                return bad(number, line, "the first line names the box: midi 0944:0117 NAME, or hid 0b33:0030 NAME");
            continue;
        }
        ReplayLine added;
        double at_ms = 0;
        const auto [rest, error] = std::from_chars(line.data(), line.data() + line.size(), at_ms);
        const std::string_view bytes(rest, static_cast<std::size_t>(line.data() + line.size() - rest));
        if (error != std::errc() || !(at_ms >= 0 && at_ms <= 1e8) || !read_bytes(bytes, added.bytes) ||
            added.bytes.empty())
            return bad(number, line, "a line is a time in milliseconds and bytes: 12.5 B0 07 40");
        added.at_ns = static_cast<std::int64_t>(at_ms * 1e6);
        if (!replay.lines.empty() && added.at_ns < replay.lines.back().at_ns)
            return bad(number, line, "times must not run backwards");
        if (replay.lines.size() == kMaxReplayLines)
            return Error{"too_large", "line " + std::to_string(number), "", "a replay has at most 1,000,000 lines"};
        replay.lines.push_back(std::move(added));
    }
    if (replay.surface.path.empty()) return bad(number, "", "the file names no box");
    return replay;
}

std::unique_ptr<Backend> make_replay_backend(Replay replay) {
    return std::make_unique<ReplayBackend>(std::move(replay));
}

}  // namespace gonio
