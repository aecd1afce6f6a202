// Open Sound Control 1.0: packets, address patterns, and the two framings of a byte stream. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "ies/core/result.h"
#include "protocol/text/byte_order.h"

namespace gonio {

inline constexpr std::size_t kOscMaxPacket = 65507;   // a UDP datagram's payload; a longer one of a stream is refused
inline constexpr std::size_t kOscMaxMessages = 4096;  // of one packet; more are refused
inline constexpr std::size_t kOscMaxArguments = 256;  // of one message; likewise
inline constexpr std::size_t kOscMaxAddress = 512;    // bytes; a longer address is refused
inline constexpr int kOscMaxNesting = 16;             // of bundles; likewise
inline constexpr std::uint64_t kOscImmediately = 1;   // the time tag that means "at once"

struct OscNil {
    bool operator==(const OscNil&) const = default;
};
struct OscImpulse {
    bool operator==(const OscImpulse&) const = default;
};
using OscBlob = std::vector<std::uint8_t>;
// i h f d s (and S, c as text) b T F N I; r and m and t are kept as i and h.
using OscArgument =
    std::variant<std::int32_t, std::int64_t, float, double, std::string, OscBlob, bool, OscNil, OscImpulse>;

struct OscMessage {
    std::uint64_t time_tag = kOscImmediately;  // NTP 32.32 of the innermost bundle around it
    std::string address;                       // begins with '/', printable ASCII; may be a pattern
    std::vector<OscArgument> arguments;
    bool operator==(const OscMessage&) const = default;
};

// Result: the packet's messages in order, those of bundles too. Errors: "bad_packet" with the byte offset as place. A
// message without a type tag string (older senders) has no arguments.
Result<std::vector<OscMessage>> decode_osc(Bytes packet);
// Result: the packet of one message.
std::vector<std::uint8_t> encode_osc(const OscMessage& message);
// Result: a bundle of the messages, to be carried out at once.
std::vector<std::uint8_t> encode_osc_bundle(const std::vector<OscMessage>& messages);

// Result: the argument as a number (i h f d, T is 1 and F is 0), or nothing.
std::optional<double> osc_number(const OscArgument& argument);

// Result: whether the pattern's part between two slashes ('?', '*', "[a-c]", "[!x]", "{one,two}") matches the name,
// which has fewer than kOscMaxAddress characters. The cost grows with the pattern's length alone, whatever it holds:
// about 10 ns a character.
bool osc_matches(std::string_view pattern, std::string_view name);
// Result: whether the text holds any character that makes it a pattern.
bool is_osc_pattern(std::string_view text);

// Names in addresses: what OSC reserves (space # * , / ? [ ] { }), '%' and all bytes outside ASCII are written as %XX.
std::string encode_osc_name(std::string_view name);
// Result: the name; %XX becomes its byte, other % stay.
std::string decode_osc_name(std::string_view part);

// Wall-clock time of an NTP time tag, nanoseconds since 1970; nothing for "at once".
std::optional<std::int64_t> osc_wall_ns(std::uint64_t time_tag);

// A TCP stream -> packets. The first byte tells the framing: OSC 1.1 SLIP begins with END (0xC0) or the packet itself,
// OSC 1.0 with the upper byte of a 32-bit length, which is 0.
class OscStream {
public:
    // Result: the packets that are complete now. Errors: "too_large", "bad_packet"; then the stream is of no more use.
    Result<std::vector<std::vector<std::uint8_t>>> feed(Bytes bytes);
    // Result: the packet framed as the other side frames; as OSC 1.0 before it has said anything.
    std::vector<std::uint8_t> frame(const std::vector<std::uint8_t>& packet) const;

private:
    enum class Framing : std::uint8_t { unknown, length, slip };
    Framing framing_ = Framing::unknown;
    std::vector<std::uint8_t> pending_;
    bool escaped_ = false;
};

}  // namespace gonio
