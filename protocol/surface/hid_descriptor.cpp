#include "protocol/surface/hid_descriptor.h"

#include <array>
#include <map>
#include <optional>

namespace gonio {
namespace {

// Item tags with their type: the prefix byte without its two bits of size.
enum : std::uint8_t {
    kInput = 0x80,
    kOutput = 0x90,
    kFeature = 0xB0,
    kCollection = 0xA0,
    kEndCollection = 0xC0,
    kUsagePage = 0x04,
    kLogicalMin = 0x14,
    kLogicalMax = 0x24,
    kReportSize = 0x74,
    kReportId = 0x84,
    kReportCount = 0x94,
    kPush = 0xA4,
    kPop = 0xB4,
    kUsage = 0x08,
    kUsageMin = 0x18,
    kUsageMax = 0x28,
    kLongItem = 0xFE
};
constexpr std::uint32_t kConstant = 1, kVariable = 2, kRelative = 4;  // flags of main items
constexpr std::size_t kMaxStack = 16, kMaxUsages = 1024;

struct Globals {
    std::uint16_t page = 0;
    std::int32_t logical_min = 0;
    std::int64_t logical_max = 0;
    std::uint32_t size = 0, count = 0;
    std::uint8_t report_id = 0;
};

// A usage is 16 bits of the page in force, or 32 bits with a page of its own.
struct Usages {
    std::vector<std::uint32_t> list;
    std::optional<std::uint32_t> min, max;
};

class Parser {
public:
    Result<HidDescriptor> parse(Bytes bytes) {
        if (bytes.size() > kMaxHidDescriptor) return bad(0, "a report descriptor has at most 4096 bytes");
        for (std::size_t at = 0; at < bytes.size();) {
            if (bytes[at] == kLongItem) {
                if (at + 2 >= bytes.size()) return bad(at, "the descriptor ends inside an item");
                at += 3u + bytes[at + 1];
                continue;
            }
            const std::size_t size = std::array{0, 1, 2, 4}[bytes[at] & 3u];
            if (at + 1 + size > bytes.size()) return bad(at, "the descriptor ends inside an item");
            std::uint32_t value = 0;
            for (std::size_t i = 0; i < size; ++i) value |= static_cast<std::uint32_t>(bytes[at + 1 + i]) << 8 * i;
            if (const char* why = item(bytes[at] & 0xFC, value, size)) return bad(at, why);
            at += 1 + size;
        }
        return std::move(out_);
    }

private:
    static Error bad(std::size_t at, const char* why) {
        return {"bad_descriptor", "byte " + std::to_string(at), "", why};
    }
    static std::int32_t signed_value(std::uint32_t value, std::size_t size) {
        if (size == 1) return static_cast<std::int8_t>(value);
        if (size == 2) return static_cast<std::int16_t>(value);
        return static_cast<std::int32_t>(value);
    }
    std::uint32_t full_usage(std::uint32_t value, std::size_t size) const {
        return size == 4 ? value : static_cast<std::uint32_t>(globals_.page) << 16 | value;
    }

    // One switch over the tags. Result: why the item cannot be used, or nullptr.
    const char* item(std::uint8_t tag, std::uint32_t value, std::size_t size) {
        switch (tag) {
            case kInput:
                return main_item(HidReport::input, value);
            case kOutput:
                return main_item(HidReport::output, value);
            case kFeature:
                return main_item(HidReport::feature, value);
            case kCollection:
                if (value == 1 && out_.page == 0 && !usages_.list.empty()) {  // application
                    out_.page = static_cast<std::uint16_t>(usages_.list[0] >> 16);
                    out_.usage = static_cast<std::uint16_t>(usages_.list[0]);
                }
                usages_ = {};
                return nullptr;
            case kEndCollection:
                usages_ = {};
                return nullptr;
            case kUsagePage:
                globals_.page = static_cast<std::uint16_t>(value);
                return nullptr;
            case kLogicalMin:
                globals_.logical_min = signed_value(value, size);
                return nullptr;
            case kLogicalMax:  // many devices write 0..255 as 00..FF in one byte: signed only where the minimum is
                               // negative
                globals_.logical_max = globals_.logical_min < 0 ? signed_value(value, size) : std::int64_t{value};
                return nullptr;
            case kReportSize:
                globals_.size = value;
                return nullptr;
            case kReportCount:
                globals_.count = value;
                return nullptr;
            case kReportId:
                if (value == 0 || value > 255) return "a report id is 1 to 255";
                globals_.report_id = static_cast<std::uint8_t>(value);
                out_.numbered = true;
                return nullptr;
            case kPush:
                if (stack_.size() == kMaxStack) return "too many pushed states";
                stack_.push_back(globals_);
                return nullptr;
            case kPop:
                if (stack_.empty()) return "a pop without a push";
                globals_ = stack_.back();
                stack_.pop_back();
                return nullptr;
            case kUsage:
                if (usages_.list.size() < kMaxUsages) usages_.list.push_back(full_usage(value, size));
                return nullptr;
            case kUsageMin:
                usages_.min = full_usage(value, size);
                break;
            case kUsageMax:
                usages_.max = full_usage(value, size);
                break;
            default:  // units, physical ranges, designators, strings
                return nullptr;
        }
        if (usages_.min && usages_.max) {
            for (std::uint32_t usage = *usages_.min; usage <= *usages_.max && usages_.list.size() < kMaxUsages;
                 ++usage) {
                usages_.list.push_back(usage);
                if (usage == UINT32_MAX) break;
            }
            usages_.min = usages_.max = std::nullopt;
        }
        return nullptr;
    }

    const char* main_item(HidReport report, std::uint32_t flags) {
        const Usages usages = std::move(usages_);
        usages_ = {};
        std::uint32_t& bit = next_bit_[{report, globals_.report_id}];
        if (globals_.size > kMaxHidReportBits || globals_.count > kMaxHidReportBits ||
            std::uint64_t{globals_.size} * globals_.count + bit > kMaxHidReportBits)
            return "a report has more than 4096 bytes";
        const std::uint32_t first = bit;
        bit += globals_.size * globals_.count;
        if ((flags & kConstant) != 0 || globals_.size == 0 || globals_.size > 32 || usages.list.empty()) return nullptr;
        for (std::uint32_t i = 0; i < globals_.count && out_.fields.size() < kMaxHidFields; ++i) {
            HidField field;
            field.report = report;
            field.report_id = globals_.report_id;
            field.bit = first + i * globals_.size;
            field.bits = globals_.size;
            field.logical_min = globals_.logical_min;
            field.logical_max = globals_.logical_max;
            field.relative = (flags & kRelative) != 0;
            field.array = (flags & kVariable) == 0;
            const std::uint32_t usage =
                field.array ? usages.list.front() : usages.list[std::min<std::size_t>(i, usages.list.size() - 1)];
            field.page = static_cast<std::uint16_t>(usage >> 16);
            field.usage = static_cast<std::uint16_t>(usage);
            field.last_usage = field.array ? static_cast<std::uint16_t>(usages.list.back()) : field.usage;
            if (field.logical_max <= field.logical_min) continue;  // nothing that it could say
            out_.fields.push_back(field);
        }
        return nullptr;
    }

    HidDescriptor out_;
    Globals globals_;
    std::vector<Globals> stack_;
    Usages usages_;
    std::map<std::pair<HidReport, std::uint8_t>, std::uint32_t> next_bit_;
};

}  // namespace

Result<HidDescriptor> parse_hid_descriptor(Bytes descriptor) {
    return Parser().parse(descriptor);
}

bool has_hid_field(const HidField& field, Bytes payload) {
    return std::size_t{field.bit} + field.bits <= payload.size() * 8;
}

std::int64_t hid_value(const HidField& field, Bytes payload) {
    std::uint64_t value = 0;
    for (std::uint32_t i = 0; i < field.bits; ++i) {
        const std::uint32_t at = field.bit + i;
        value |= static_cast<std::uint64_t>(payload[at / 8] >> at % 8 & 1u) << i;
    }
    if (field.logical_min < 0 && (value >> (field.bits - 1) & 1u) != 0)
        return static_cast<std::int64_t>(value) - (std::int64_t{1} << field.bits);
    return static_cast<std::int64_t>(value);
}

void put_hid_value(const HidField& field, std::uint32_t value, std::vector<std::uint8_t>& payload) {
    for (std::uint32_t i = 0; i < field.bits; ++i) {
        const std::uint32_t at = field.bit + i;
        const auto mask = static_cast<std::uint8_t>(1u << at % 8);
        if ((value >> i & 1u) != 0)
            payload[at / 8] |= mask;
        else
            payload[at / 8] &= static_cast<std::uint8_t>(~mask);
    }
}

}  // namespace gonio
