// HID report descriptors (USB HID 1.11, clause 6.2.2) and the fields of reports. Pure.
#pragma once

#include <cstdint>
#include <vector>

#include "ies/core/result.h"
#include "protocol/text/byte_order.h"

namespace gonio {

inline constexpr std::size_t kMaxHidDescriptor = 4096;  // bytes; Linux reads no more
inline constexpr std::size_t kMaxHidFields = 1024;      // further ones are not listed
inline constexpr std::uint32_t kMaxHidReportBits = 8 * 4096;

enum class HidReport : std::uint8_t { input, output, feature };

// One value of a report. Constant and padding bits are none.
struct HidField {
    HidReport report = HidReport::input;
    std::uint8_t report_id = 0;    // 0: the device does not number its reports
    std::uint32_t bit = 0;         // of the report, after its id
    std::uint32_t bits = 0;        // 1..32
    std::int32_t logical_min = 0;  // what it says lies between these; else it says nothing ("null state")
    std::int64_t logical_max = 0;
    std::uint16_t page = 0, usage = 0;
    bool relative = false;
    bool array = false;  // it says which of the usages [usage, last_usage] is on, counted from logical_min
    std::uint16_t last_usage = 0;
};

struct HidDescriptor {
    std::vector<HidField> fields;
    bool numbered = false;              // reports begin with their id
    std::uint16_t page = 0, usage = 0;  // of the first application collection: 1/4 is a joystick
};

// Errors: "bad_descriptor" with "byte N" as place.
Result<HidDescriptor> parse_hid_descriptor(Bytes descriptor);

// Result: whether the field lies in the report's `payload` (what follows the id).
bool has_hid_field(const HidField& field, Bytes payload);
// Result: its value, sign-extended where logical_min is negative. The field must lie in the payload.
std::int64_t hid_value(const HidField& field, Bytes payload);
// Writes a value into the payload of an output report. The field must lie in it.
void put_hid_value(const HidField& field, std::uint32_t value, std::vector<std::uint8_t>& payload);

}  // namespace gonio
