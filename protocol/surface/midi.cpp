#include "protocol/surface/midi.h"

#include <algorithm>
#include <charconv>

#include "ies/core/text.h"

namespace gonio {
namespace {

// Data bytes of channel messages 8n to En.
unsigned data_bytes(std::uint8_t status) {
    return (status & 0xE0) == 0xC0 ? 1 : 2;
}

bool is_channel_message(std::uint8_t status) {
    return status >= 0x80 && status < 0xF0;
}

struct KindRow {
    std::string_view name;
    std::uint8_t status;      // upper four bits
    bool has_number = false;  // of a controller or note
    bool has_channel = true;
};
// In the order of MidiKind.
constexpr KindRow kKinds[] = {{"cc", 0xB, true},
                              {"note", 0x9, true},
                              {"bend", 0xE},
                              {"pressure", 0xD},
                              {"poly", 0xA, true},
                              {"program", 0xC},
                              {"volume", kVolume >> 4, false, false}};
constexpr std::size_t kMaxKeys = 128;

const KindRow& row_of(MidiKind kind) {
    return kKinds[static_cast<std::size_t>(kind)];
}

Error bad_key(std::string_view text) {
    return {"bad_surface", "", shown_text(text),
            "a message is written like \"cc 1/7\", \"note 1/60\" or \"bend 1\", several like \"cc 1/0-7, cc 1/16\""};
}

struct Span {
    unsigned first, last;
};

// Data bytes of F1, F2 and F3; SysEx has its end, others have none.
unsigned common_bytes(std::uint8_t status) {
    return status == 0xF2 ? 2 : status == 0xF1 || status == 0xF3 ? 1 : 0;
}

// Result: "7" or "0-7"; "*" is 0..0 where that is allowed.
std::optional<Span> parse_span(std::string_view text, unsigned least, unsigned most) {
    Span span{};
    const char* end = text.data() + text.size();
    auto first = std::from_chars(text.data(), end, span.first);
    if (first.ec != std::errc()) return std::nullopt;
    span.last = span.first;
    if (first.ptr != end) {
        if (*first.ptr != '-') return std::nullopt;
        const auto last = std::from_chars(first.ptr + 1, end, span.last);
        if (last.ec != std::errc() || last.ptr != end) return std::nullopt;
    }
    if (span.first < least || span.last > most || span.first > span.last) return std::nullopt;
    return span;
}

std::string_view trimmed(std::string_view text) {
    while (text.starts_with(' ')) text.remove_prefix(1);
    while (text.ends_with(' ')) text.remove_suffix(1);
    return text;
}

bool add_keys(std::string_view text, std::vector<MidiKey>& keys) {
    MidiKey key;
    if (text.starts_with("port ")) {
        const std::size_t colon = text.find(':');
        if (colon == text.npos) return false;
        const auto port = parse_span(text.substr(5, colon - 5), 1, 16);
        if (!port || port->first != port->last) return false;
        key.cable = static_cast<std::uint8_t>(port->first - 1);
        text = trimmed(text.substr(colon + 1));
    }
    const std::size_t space = text.find(' ');
    if (space == text.npos) return false;
    const auto kind = std::ranges::find(kKinds, text.substr(0, space), &KindRow::name);
    if (kind == std::end(kKinds)) return false;
    key.kind = static_cast<MidiKind>(kind - std::begin(kKinds));
    text = trimmed(text.substr(space + 1));
    const std::size_t slash = text.find('/');
    if ((slash != text.npos) != kind->has_number) return false;
    const std::string_view channel_text = text.substr(0, slash);
    const auto channels = channel_text == "*" ? std::optional(Span{0, 0}) : parse_span(channel_text, 1, 16);
    const auto numbers = slash == text.npos ? std::optional(Span{0, 0}) : parse_span(text.substr(slash + 1), 0, 127);
    if (!channels || !numbers || (!kind->has_channel && channel_text != "*")) return false;
    for (unsigned channel = channels->first; channel <= channels->last; ++channel) {
        for (unsigned number = numbers->first; number <= numbers->last; ++number) {
            if (keys.size() == kMaxKeys) return false;
            key.channel = static_cast<std::uint8_t>(channel);
            key.number = static_cast<std::uint8_t>(number);
            keys.push_back(key);
        }
    }
    return true;
}

}  // namespace

// Bytes of a packet, by its code index number (clause 4, table 4-1).
static constexpr std::uint8_t kPacketBytes[16] = {0, 0, 2, 3, 3, 1, 2, 3, 3, 3, 3, 3, 2, 2, 3, 1};

std::size_t read_usb_midi(Bytes transfer, std::vector<MidiMessage>& messages, MidiSystem* system) {
    std::size_t bad = 0;
    for (; transfer.size() >= 4; transfer = transfer.subspan(4)) {
        const unsigned index = transfer[0] & 0x0Fu;
        const auto cable = static_cast<std::uint8_t>(transfer[0] >> 4);
        if (system != nullptr)
            for (std::size_t i = 1; i <= kPacketBytes[index]; ++i) system->take(transfer[i], cable, messages);
        if (index < 8 || index == 15) {  // reserved (0, 1: also padding), system messages, single bytes
            bad += index < 2 && (transfer[1] | transfer[2] | transfer[3]) != 0 ? 1 : 0;
            continue;
        }
        const std::uint8_t status = transfer[1];
        const bool two = data_bytes(status) == 2;
        if (status >> 4 != index || transfer[2] > 0x7F || (two && transfer[3] > 0x7F)) {
            ++bad;
            continue;
        }
        messages.push_back({cable, status, {transfer[2], two ? transfer[3] : std::uint8_t{0}}});
    }
    return bad;
}

std::size_t MidiStream::take(Bytes bytes, std::vector<MidiMessage>& messages) {
    std::size_t bad = 0;
    for (const std::uint8_t byte : bytes) {
        system_.take(byte, 0, messages);
        if (byte >= 0xF8) continue;  // real-time: may stand inside any message
        if (skips_ > 0 && byte < 0x80) {
            --skips_;
            continue;
        }
        skips_ = common_bytes(byte);
        if (byte >= 0x80) {
            sysex_ = byte == 0xF0;
            status_ = is_channel_message(byte) ? byte : 0;
            has_first_ = false;
            continue;
        }
        if (sysex_) continue;
        if (status_ == 0) {
            ++bad;  // a port that was opened in the middle of a message
            continue;
        }
        if (data_bytes(status_) == 2 && !has_first_) {
            first_ = byte;
            has_first_ = true;
            continue;
        }
        MidiMessage message{0, status_, {byte, 0}};
        if (has_first_) message.data = {first_, byte};
        messages.push_back(message);
        has_first_ = false;
    }
    return bad;
}

std::vector<std::uint8_t> usb_midi_packets(std::uint8_t cable, Bytes message) {
    std::vector<std::uint8_t> packets;
    const auto head = [&](unsigned index) { return static_cast<std::uint8_t>(cable << 4 | index); };
    if (message.empty()) return packets;
    if (is_channel_message(message[0])) {
        packets = {head(message[0] >> 4u), message[0], message.size() > 1 ? message[1] : std::uint8_t{0},
                   message.size() > 2 ? message[2] : std::uint8_t{0}};
        return packets;
    }
    while (!message.empty()) {  // SysEx: 4 goes on, 5, 6, 7 end with one, two, three bytes
        const std::size_t count = std::min<std::size_t>(3, message.size());
        const bool ends = count == message.size();
        packets.push_back(head(ends ? 4 + static_cast<unsigned>(count) : 4));
        for (std::size_t i = 0; i < 3; ++i) packets.push_back(i < count ? message[i] : std::uint8_t{0});
        message = message.subspan(count);
    }
    return packets;
}

std::string midi_key_text(const MidiKey& key) {
    std::string text = key.cable == 0 ? "" : "port " + std::to_string(key.cable + 1) + ": ";
    text += row_of(key.kind).name;
    text += " " + (key.channel == 0 ? "*" : std::to_string(key.channel));
    if (row_of(key.kind).has_number) text += "/" + std::to_string(key.number);
    return text;
}

Result<std::vector<MidiKey>> parse_midi_keys(std::string_view text) {
    std::vector<MidiKey> keys;
    for (std::string_view rest = text;;) {
        const std::size_t comma = rest.find(',');
        if (!add_keys(trimmed(rest.substr(0, comma)), keys)) return bad_key(text);
        if (comma == rest.npos) return keys;
        rest.remove_prefix(comma + 1);
    }
}

MidiKey key_of(const MidiMessage& message) {
    if (message.status == kVolume) return {message.cable, MidiKind::volume, 0, 0};
    const auto channel = static_cast<std::uint8_t>((message.status & 0x0F) + 1);
    const int status = std::max(message.status >> 4, 0x9);  // a note-off is of its note
    const auto kind = std::ranges::find(kKinds, status, &KindRow::status);
    return {message.cable, static_cast<MidiKind>(kind - std::begin(kKinds)), channel,
            kind->has_number ? message.data[0] : std::uint8_t{0}};
}

std::uint32_t value_of(const MidiMessage& message) {
    switch (message.status >> 4) {
        case 0x8:
            return 0;
        case 0xC:
        case 0xD:
            return message.data[0];
        case 0xE:
        case kVolume >> 4:
            return static_cast<std::uint32_t>(message.data[1] << 7 | message.data[0]);
        default:
            return message.data[1];
    }
}

std::vector<std::uint8_t> midi_message(const MidiKey& key, std::uint32_t value) {
    const auto fine = static_cast<std::uint8_t>(value & 0x7F), coarse = static_cast<std::uint8_t>(value >> 7 & 0x7F);
    if (key.kind == MidiKind::volume) return {0xF0, 0x7F, 0x7F, 0x04, 0x01, fine, coarse, 0xF7};
    const KindRow& kind = row_of(key.kind);
    const int channel = key.channel == 0 ? 0 : key.channel - 1;
    std::vector<std::uint8_t> message{static_cast<std::uint8_t>(kind.status << 4 | channel)};
    if (kind.has_number) message.push_back(key.number);
    message.push_back(fine);
    if (key.kind == MidiKind::bend) message.push_back(coarse);
    return message;
}

}  // namespace gonio
