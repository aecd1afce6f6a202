#include "protocol/osc/osc.h"

#include <algorithm>
#include <array>
#include <bit>
#include <bitset>
#include <cstring>

#include "protocol/text/text_bytes.h"

namespace gonio {
namespace {

constexpr std::uint8_t kBundle[8] = {'#', 'b', 'u', 'n', 'd', 'l', 'e', 0};
constexpr std::uint8_t kSlipEnd = 0xC0, kSlipEscape = 0xDB, kSlipEscapedEnd = 0xDC, kSlipEscapedEscape = 0xDD;
constexpr std::int64_t kNtpToUnix_s = 2'208'988'800;  // 1900 to 1970, RFC 5905

Error bad(std::size_t at, std::string value, std::string message) {
    return {"bad_packet", "byte " + std::to_string(at), std::move(value), std::move(message)};
}

// Reads one message or bundle. Offsets are those of the whole packet.
class Reader {
public:
    Reader(Bytes packet, std::vector<OscMessage>& out) : packet_(packet), out_(out) {}

    std::optional<Error> element(std::size_t at, std::size_t end, std::uint64_t time_tag, int depth) {
        if (end - at >= 8 && std::memcmp(packet_.data() + at, kBundle, 8) == 0) return bundle(at, end, depth);
        return message(at, end, time_tag);
    }

private:
    std::optional<Error> bundle(std::size_t at, std::size_t end, int depth) {
        if (depth >= kOscMaxNesting) return bad(at, "", "bundles nest deeper than 16 levels");
        if (end - at < 16) return bad(at, "", "a bundle ends before its time tag");
        const std::uint64_t time_tag = be64(packet_, at + 8);
        for (at += 16; at < end;) {
            if (end - at < 4) return bad(at, "", "a bundle ends inside an element's size");
            const std::uint32_t size = be32(packet_, at);
            if (size % 4 != 0 || size == 0 || size > end - at - 4)
                return bad(at, std::to_string(size), "an element's size is not a multiple of 4 inside its bundle");
            if (auto error = element(at + 4, at + 4 + size, time_tag, depth + 1)) return error;
            at += 4 + size;
        }
        return std::nullopt;
    }

    // A zero-terminated string padded to 4 bytes. Result: its text; `at` moves behind it.
    std::optional<std::string> text(std::size_t& at, std::size_t end) {
        const auto begin = packet_.begin() + static_cast<std::ptrdiff_t>(at);
        const auto limit = packet_.begin() + static_cast<std::ptrdiff_t>(end);
        const auto zero = std::find(begin, limit, 0);
        if (zero == limit) return std::nullopt;
        const auto length = static_cast<std::size_t>(zero - begin);
        const std::size_t padded = (length + 4) & ~std::size_t{3};
        if (padded > end - at) return std::nullopt;
        std::string result = printable_text(packet_.subspan(at, length));
        at += padded;
        return result;
    }

    std::optional<Error> message(std::size_t at, std::size_t end, std::uint64_t time_tag) {
        if (out_.size() >= kOscMaxMessages) return bad(at, "", "the packet holds more than 4,096 messages");
        OscMessage message;
        message.time_tag = time_tag;
        const std::size_t start = at;
        auto address = text(at, end);
        if (!address || address->empty() || address->front() != '/')
            return bad(start, address ? shown_text(*address) : "",
                       "an OSC address begins with a slash and ends with a zero");
        if (address->size() > kOscMaxAddress)
            return bad(start, shown_text(*address), "an OSC address has at most 512 bytes");
        for (std::size_t i = 0; i < address->size(); ++i)
            if (packet_[start + i] < 0x21 || packet_[start + i] > 0x7E)
                return bad(start + i, std::to_string(packet_[start + i]), "an OSC address is printable ASCII");
        message.address = std::move(*address);
        if (at < end && packet_[at] == ',') {
            const std::size_t tags_at = at;
            const auto tags = text(at, end);
            if (!tags) return bad(tags_at, "", "the type tags do not end");
            if (tags->size() - 1 > kOscMaxArguments) return bad(tags_at, "", "the message has more than 256 arguments");
            for (std::size_t i = 1; i < tags->size(); ++i)
                if (auto error = argument((*tags)[i], at, end, message)) return error;
        }
        out_.push_back(std::move(message));
        return std::nullopt;
    }

    // One switch over the type tags.
    std::optional<Error> argument(char tag, std::size_t& at, std::size_t end, OscMessage& message) {
        const auto ends = [&] {
            return bad(at, shown_text(std::string(1, tag)), "the packet ends inside an argument");
        };
        const auto is_one_of = [&](std::string_view tags) { return tags.find(tag) != tags.npos; };
        const std::size_t fixed = is_one_of("irmfcb") ? 4 : is_one_of("htd") ? 8 : 0;  // bytes
        if (end - at < fixed) return ends();
        std::vector<OscArgument>& out = message.arguments;
        switch (tag) {
            case 'i':
            case 'r':
            case 'm':
                out.emplace_back(static_cast<std::int32_t>(be32(packet_, at)));
                break;
            case 'f':
                out.emplace_back(std::bit_cast<float>(be32(packet_, at)));
                break;
            case 'h':
            case 't':
                out.emplace_back(static_cast<std::int64_t>(be64(packet_, at)));
                break;
            case 'd':
                out.emplace_back(std::bit_cast<double>(be64(packet_, at)));
                break;
            case 'c':
                out.emplace_back(printable_text(packet_.subspan(at + 3, 1)));
                break;
            case 's':
            case 'S': {
                auto value = text(at, end);
                if (!value) return ends();
                out.emplace_back(std::move(*value));
                break;
            }
            case 'b': {
                const std::size_t size = be32(packet_, at), padded = (size + 3) & ~std::size_t{3};
                if (size > end - at - 4 || padded > end - at - 4) return ends();
                const auto begin = packet_.begin() + static_cast<std::ptrdiff_t>(at + 4);
                out.emplace_back(OscBlob(begin, begin + static_cast<std::ptrdiff_t>(size)));
                at += padded;
                break;
            }
            case 'T':
            case 'F':
                out.emplace_back(tag == 'T');
                break;
            case 'N':
                out.emplace_back(OscNil{});
                break;
            case 'I':
                out.emplace_back(OscImpulse{});
                break;
            case '[':  // arrays: their elements stand in line
            case ']':
                break;
            default:
                return bad(at, shown_text(std::string(1, tag)), "the type tag is unknown, so its size is too");
        }
        at += fixed;
        return std::nullopt;
    }

    Bytes packet_;
    std::vector<OscMessage>& out_;
};

void put32(std::vector<std::uint8_t>& out, std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<std::uint8_t>(value >> shift));
}
void put64(std::vector<std::uint8_t>& out, std::uint64_t value) {
    put32(out, static_cast<std::uint32_t>(value >> 32));
    put32(out, static_cast<std::uint32_t>(value));
}
void put_text(std::vector<std::uint8_t>& out, const std::string& text) {
    out.insert(out.end(), text.begin(), text.end());
    out.resize((out.size() + 4) & ~std::size_t{3}, 0);
}

struct Encoder {
    std::string& tags;
    std::vector<std::uint8_t>& data;
    void operator()(std::int32_t value) const { tags += 'i', put32(data, static_cast<std::uint32_t>(value)); }
    void operator()(std::int64_t value) const { tags += 'h', put64(data, static_cast<std::uint64_t>(value)); }
    void operator()(float value) const { tags += 'f', put32(data, std::bit_cast<std::uint32_t>(value)); }
    void operator()(double value) const { tags += 'd', put64(data, std::bit_cast<std::uint64_t>(value)); }
    void operator()(const std::string& value) const { tags += 's', put_text(data, value); }
    void operator()(const OscBlob& value) const {
        tags += 'b';
        put32(data, static_cast<std::uint32_t>(value.size()));
        data.insert(data.end(), value.begin(), value.end());
        data.resize((data.size() + 3) & ~std::size_t{3}, 0);
    }
    void operator()(bool value) const { tags += value ? 'T' : 'F'; }
    void operator()(OscNil) const { tags += 'N'; }
    void operator()(OscImpulse) const { tags += 'I'; }
};

// Sets of positions in a name, one bit each: all of them take a step of the pattern at once, so nothing is tried twice.
using Positions = std::bitset<kOscMaxAddress>;
using Characters = std::bitset<128>;  // of ASCII

// A name, ready to be matched.
struct Name {
    explicit Name(std::string_view name) {
        for (std::size_t i = 0; i < name.size(); ++i) {
            all.set(i);
            const auto byte = static_cast<unsigned char>(name[i]);
            if (byte >= where.size()) continue;
            where[byte].set(i);
            present.set(byte);
        }
    }
    Positions positions_of(char c) const {
        const auto byte = static_cast<unsigned char>(c);
        return byte < where.size() ? where[byte] : Positions();
    }
    Positions all;                          // that hold a character
    Characters present;                     // which do
    std::array<Positions, 128> where = {};  // where each one stands
};

// Result: the positions of the characters that the bracket expression at the front of `pattern` holds; `pattern` moves
// behind it.
Positions bracket_positions(std::string_view& pattern, const Name& name) {
    pattern.remove_prefix(1);
    const bool negated = pattern.starts_with('!');
    if (negated) pattern.remove_prefix(1);
    Characters held;
    const auto hold = [&](unsigned char first, unsigned char last) {
        for (unsigned c = first; c <= last && c < held.size(); ++c) held.set(c);
    };
    while (!pattern.empty() && pattern.front() != ']') {
        const bool range = pattern.size() >= 3 && pattern[1] == '-' && pattern[2] != ']';
        hold(static_cast<unsigned char>(pattern[0]), static_cast<unsigned char>(pattern[range ? 2 : 0]));
        pattern.remove_prefix(range ? 3 : 1);
    }
    if (!pattern.empty()) pattern.remove_prefix(1);
    held &= name.present;
    Positions positions;
    for (std::size_t c = held._Find_first(); c < held.size(); c = held._Find_next(c)) positions |= name.where[c];
    return negated ? name.all & ~positions : positions;
}

// Result: the positions behind any of the words of the braces at the front of `pattern`, from the positions reached so
// far; `pattern` moves behind them.
Positions brace_positions(std::string_view& pattern, const Name& name, const Positions& reached) {
    pattern.remove_prefix(1);
    const std::size_t close = std::min(pattern.find('}'), pattern.size());
    const std::string_view list = pattern.substr(0, close);
    pattern.remove_prefix(std::min(close + 1, pattern.size()));
    Positions next, word = reached;
    for (const char c : list) {
        if (c == ',') {
            next |= word;
            word = reached;
        } else {
            word = (word & name.positions_of(c)) << 1;
        }
    }
    return next | word;
}

}  // namespace

Result<std::vector<OscMessage>> decode_osc(Bytes packet) {
    if (packet.empty() || packet.size() % 4 != 0)
        return bad(packet.size(), std::to_string(packet.size()), "an OSC packet's size is a multiple of 4");
    std::vector<OscMessage> messages;
    if (auto error = Reader(packet, messages).element(0, packet.size(), kOscImmediately, 0)) return *error;
    return messages;
}

std::vector<std::uint8_t> encode_osc(const OscMessage& message) {
    std::vector<std::uint8_t> packet, data;
    std::string tags = ",";
    for (const OscArgument& argument : message.arguments) std::visit(Encoder{tags, data}, argument);
    put_text(packet, message.address);
    put_text(packet, tags);
    packet.insert(packet.end(), data.begin(), data.end());
    return packet;
}

std::vector<std::uint8_t> encode_osc_bundle(const std::vector<OscMessage>& messages) {
    std::vector<std::uint8_t> packet(std::begin(kBundle), std::end(kBundle));
    put64(packet, kOscImmediately);
    for (const OscMessage& message : messages) {
        const std::vector<std::uint8_t> element = encode_osc(message);
        put32(packet, static_cast<std::uint32_t>(element.size()));
        packet.insert(packet.end(), element.begin(), element.end());
    }
    return packet;
}

std::optional<double> osc_number(const OscArgument& argument) {
    if (const auto* i = std::get_if<std::int32_t>(&argument)) return *i;
    if (const auto* h = std::get_if<std::int64_t>(&argument)) return static_cast<double>(*h);
    if (const auto* f = std::get_if<float>(&argument)) return static_cast<double>(*f);
    if (const auto* d = std::get_if<double>(&argument)) return *d;
    if (const auto* b = std::get_if<bool>(&argument)) return *b ? 1.0 : 0.0;
    return std::nullopt;
}

bool osc_matches(std::string_view pattern, std::string_view text) {
    if (!is_osc_pattern(pattern)) return pattern == text;
    if (text.size() >= kOscMaxAddress) return false;
    const Name name(text);
    Positions reached;  // bit n: the pattern so far can have read the first n characters
    reached.set(0);
    while (!pattern.empty() && reached.any()) {
        const char c = pattern.front();
        if (c == '{') {
            reached = brace_positions(pattern, name, reached);
        } else if (c == '[') {
            const Positions positions = bracket_positions(pattern, name);
            reached = (reached & positions) << 1;
        } else {
            if (c == '*') {  // all positions from the first one on
                const std::size_t first = reached._Find_first();
                reached = ((name.all << 1).set(0) >> first) << first;
            } else {
                reached = (reached & (c == '?' ? name.all : name.positions_of(c))) << 1;
            }
            pattern.remove_prefix(1);
        }
    }
    return reached.test(text.size());
}

bool is_osc_pattern(std::string_view text) {
    return text.find_first_of("?*[{") != std::string_view::npos;
}

std::string encode_osc_name(std::string_view name) {
    static const char* digits = "0123456789ABCDEF";
    std::string text;
    for (const char c : name) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte > 0x20 && byte < 0x7F && std::strchr("#*,/?[]{}%", c) == nullptr) {
            text += c;
            continue;
        }
        text += '%';
        text += digits[byte >> 4];
        text += digits[byte & 15];
    }
    return text;
}

std::string decode_osc_name(std::string_view part) {
    std::string name;
    for (std::size_t at = 0; at < part.size(); ++at) {
        const bool escape = part[at] == '%' && at + 2 < part.size();
        const int high = escape ? hex_digit(part[at + 1]) : -1, low = escape ? hex_digit(part[at + 2]) : -1;
        const bool byte = high >= 0 && low >= 0;
        name += byte ? static_cast<char>(high * 16 + low) : part[at];
        if (byte) at += 2;
    }
    return name;
}

std::optional<std::int64_t> osc_wall_ns(std::uint64_t time_tag) {
    if (time_tag == kOscImmediately) return std::nullopt;
    const auto seconds = static_cast<std::int64_t>(time_tag >> 32) - kNtpToUnix_s;
    const auto fraction_ns = static_cast<std::int64_t>(((time_tag & 0xFFFFFFFFu) * 1'000'000'000u) >> 32);
    return seconds * 1'000'000'000 + fraction_ns;
}

Result<std::vector<std::vector<std::uint8_t>>> OscStream::feed(Bytes bytes) {
    std::vector<std::vector<std::uint8_t>> packets;
    if (framing_ == Framing::unknown && !bytes.empty()) framing_ = bytes[0] == 0 ? Framing::length : Framing::slip;
    if (framing_ == Framing::slip) {
        for (const std::uint8_t byte : bytes) {
            if (byte == kSlipEnd && !escaped_) {
                if (!pending_.empty()) packets.push_back(std::move(pending_));
                pending_.clear();
                continue;
            }
            if (escaped_ && byte != kSlipEscapedEnd && byte != kSlipEscapedEscape)
                return Error{"bad_packet", "", std::to_string(byte), "the SLIP stream holds an unknown escape"};
            if (!escaped_ && byte == kSlipEscape) {
                escaped_ = true;
                continue;
            }
            pending_.push_back(!escaped_ ? byte : byte == kSlipEscapedEnd ? kSlipEnd : kSlipEscape);
            escaped_ = false;
            if (pending_.size() > kOscMaxPacket)
                return Error{"too_large", "", std::to_string(pending_.size()),
                             "an OSC packet is longer than 65,507 bytes"};
        }
        return packets;
    }
    pending_.insert(pending_.end(), bytes.begin(), bytes.end());
    std::size_t at = 0;
    while (pending_.size() - at >= 4) {
        const std::size_t size = be32(pending_, at);
        if (size > kOscMaxPacket)
            return Error{"too_large", "", std::to_string(size), "an OSC packet is longer than 65,507 bytes"};
        if (pending_.size() - at - 4 < size) break;
        const auto begin = pending_.begin() + static_cast<std::ptrdiff_t>(at + 4);
        if (size > 0) packets.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(size));
        at += 4 + size;
    }
    pending_.erase(pending_.begin(), pending_.begin() + static_cast<std::ptrdiff_t>(at));
    return packets;
}

std::vector<std::uint8_t> OscStream::frame(const std::vector<std::uint8_t>& packet) const {
    std::vector<std::uint8_t> framed;
    if (framing_ != Framing::slip) {
        put32(framed, static_cast<std::uint32_t>(packet.size()));
        framed.insert(framed.end(), packet.begin(), packet.end());
        return framed;
    }
    framed.push_back(kSlipEnd);
    for (const std::uint8_t byte : packet) {
        if (byte == kSlipEnd || byte == kSlipEscape) {
            framed.push_back(kSlipEscape);
            framed.push_back(byte == kSlipEnd ? kSlipEscapedEnd : kSlipEscapedEscape);
        } else {
            framed.push_back(byte);
        }
    }
    framed.push_back(kSlipEnd);
    return framed;
}

}  // namespace gonio
