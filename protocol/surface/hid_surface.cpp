#include "protocol/surface/hid_surface.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

namespace gonio {
namespace {

constexpr std::size_t kMaxArrayUsages = 256;

// Result: the control's name by the HID usage tables 1.12; more of one name are numbered.
std::string usage_name(std::uint16_t page, std::uint16_t usage) {
    if (page == 0x09) return "button " + std::to_string(usage);
    if (page == 0x01) {
        static constexpr const char* kNames[] = {"x", "y", "z", "rx", "ry", "rz", "slider", "dial", "wheel", "hat"};
        if (usage >= 0x30 && usage <= 0x39) return kNames[usage - 0x30];
    }
    if (page == 0x02) {  // simulation controls
        if (usage == 0xBA) return "rudder";
        if (usage == 0xBB) return "throttle";
        if (usage == 0xC4) return "accelerator";
        if (usage == 0xC5) return "brake";
    }
    if (page == 0x0C && usage == 0xE0) return "volume";
    char text[24];
    std::snprintf(text, sizeof text, "usage %02x/%02x", page, usage);
    return text;
}

bool centres(const HidField& field, const HidDescriptor& descriptor) {
    const bool axis = field.page == 1 && field.usage >= 0x30 && field.usage <= 0x35;
    return axis && (field.logical_min < 0 || descriptor.usage == 0x05 || descriptor.usage == 0x08);
}

ControlSpec spec_of(std::string name, ControlKind kind, std::uint32_t steps = 0) {
    ControlSpec spec;
    spec.name = std::move(name);
    spec.kind = kind;
    spec.steps = steps;
    return spec;
}

}  // namespace

// Boxes whose descriptors say nothing about what the bytes mean, or nothing true.
struct HidSurface::Known {
    std::uint16_t vendor, first_product, last_product;
    const char* name;
    unsigned buttons;
    bool (HidSurface::*take)(Bytes, std::vector<ControlEvent>&);
};
const HidSurface::Known HidSurface::kKnown[] = {
    {0x0b33, 0x0010, 0x0010, "Contour ShuttlePRO", 13, &HidSurface::take_shuttle},
    {0x0b33, 0x0020, 0x0020, "Contour ShuttleXpress", 5, &HidSurface::take_shuttle},
    {0x0b33, 0x0030, 0x0030, "Contour ShuttlePRO v2", 15, &HidSurface::take_shuttle},
    {0x077d, 0x0410, 0x0410, "Griffin PowerMate", 1, &HidSurface::take_powermate},
    {0x046d, 0xc621, 0xc62f, "3Dconnexion SpaceMouse", 32, &HidSurface::take_spacemouse},
    {0x256f, 0xc62e, 0xc63f, "3Dconnexion SpaceMouse", 32, &HidSurface::take_spacemouse},
    {0x0fd9, 0x0084, 0x0084, "Elgato Stream Deck +", 8, &HidSurface::take_stream_deck_plus},
    {0x05f3, 0x0403, 0x0403, "X-keys XK-24", 24, &HidSurface::take_xkeys},
    {0x05f3, 0x0405, 0x0405, "X-keys XK-24", 24, &HidSurface::take_xkeys},
};

const HidSurface::Known* HidSurface::find_known(std::uint16_t vendor, std::uint16_t product) {
    for (const Known& known : kKnown)
        if (known.vendor == vendor && product >= known.first_product && product <= known.last_product) return &known;
    return nullptr;
}

bool is_of_people(std::uint16_t page, std::uint16_t usage) {
    const bool desktop = page == 0x01 && (usage == 0x01 || usage == 0x02 || usage == 0x06 || usage == 0x07);
    return desktop || page == 0x0D || page == 0xF1D0;
}

bool is_control_box(std::uint16_t vendor, std::uint16_t product, std::uint16_t page, std::uint16_t usage,
                    bool of_people) {
    if (HidSurface::find_known(vendor, product) != nullptr) return true;
    if (of_people) return false;
    return (page == 0x01 && (usage == 0x04 || usage == 0x05 || usage == 0x08)) || (page == 0x0C && usage == 0x01);
}

std::size_t HidSurface::add(ControlSpec spec) {
    controls_.push_back(std::move(spec));
    said_.emplace_back();
    return controls_.size() - 1;
}

Result<HidSurface> HidSurface::open(std::uint16_t vendor, std::uint16_t product, Bytes descriptor) {
    HidSurface surface;
    surface.known_ = find_known(vendor, product);
    if (surface.known_ == nullptr) {
        const auto parsed = parse_hid_descriptor(descriptor);
        if (!parsed) return parsed.error();
        surface.numbered_ = parsed->numbered;
        surface.add_fields(*parsed);
        if (surface.controls_.empty())
            return Error{"bad_descriptor", "", "", "the descriptor has no control that could be read"};
        surface.add_lamps(*parsed);
        return surface;
    }
    surface.name_ = surface.known_->name;
    const auto take = surface.known_->take;
    if (take == &HidSurface::take_shuttle) {
        ControlSpec shuttle = spec_of("shuttle", ControlKind::absolute, 14);
        shuttle.centred = true;
        surface.add(shuttle);
        surface.add(spec_of("jog", ControlKind::relative));
    } else if (take == &HidSurface::take_powermate) {
        ControlSpec knob = spec_of("knob", ControlKind::relative);
        knob.show = ShowKind::value;
        surface.add(knob);
    } else if (take == &HidSurface::take_spacemouse) {
        for (const char* axis : {"x", "y", "z", "rx", "ry", "rz"}) {
            ControlSpec spec = spec_of(axis, ControlKind::absolute, 700);
            spec.centred = true;
            surface.add(spec);
        }
    } else if (take == &HidSurface::take_stream_deck_plus) {
        for (int i = 1; i <= 4; ++i) surface.add(spec_of("dial " + std::to_string(i), ControlKind::relative));
        for (int i = 1; i <= 4; ++i) surface.add(spec_of("dial push " + std::to_string(i), ControlKind::button));
        surface.add(spec_of("strip", ControlKind::absolute, 799));
    }
    const bool lit = take == &HidSurface::take_xkeys;
    for (unsigned i = 1; i <= surface.known_->buttons; ++i) {
        ControlSpec button = spec_of("button " + std::to_string(i), ControlKind::button);
        if (lit) button.show = ShowKind::lamp;
        surface.add(button);
    }
    return surface;
}

void HidSurface::add_fields(const HidDescriptor& descriptor) {
    std::map<std::string, unsigned> count, seen;
    const auto listed = [](const HidField& field) { return field.report == HidReport::input; };
    for (const HidField& field : descriptor.fields)
        if (listed(field) && !field.array) ++count[usage_name(field.page, field.usage)];
    for (const HidField& field : descriptor.fields) {
        if (!listed(field) || controls_.size() >= kMaxSurfaceControls) continue;
        if (field.array) {
            const auto known = std::find_if(fields_.begin(), fields_.end(), [&](const ReportField& other) {
                return other.field.array && other.field.page == field.page && other.field.usage == field.usage;
            });
            if (field.last_usage < field.usage) continue;
            ReportField added{field, known == fields_.end() ? controls_.size() : known->control};
            if (known == fields_.end()) {
                const std::size_t usages =
                    std::min<std::size_t>({static_cast<std::size_t>(field.last_usage - field.usage) + 1,
                                           kMaxArrayUsages, kMaxSurfaceControls - controls_.size()});
                for (std::size_t i = 0; i < usages; ++i)
                    add(spec_of(usage_name(field.page, static_cast<std::uint16_t>(field.usage + i)),
                                ControlKind::button));
                added.field.last_usage = static_cast<std::uint16_t>(field.usage + usages - 1);
            } else {
                added.field.last_usage = known->field.last_usage;  // another field of the same buttons
            }
            fields_.push_back(added);
            continue;
        }
        std::string name = usage_name(field.page, field.usage);
        if (count[name] > 1) {
            const unsigned number = ++seen[name];
            name += (field.page == 9 ? "." : " ") + std::to_string(number);
        }
        const std::int64_t steps = field.logical_max - field.logical_min;
        ControlSpec spec = spec_of(name, field.relative ? ControlKind::relative
                                         : steps == 1   ? ControlKind::button
                                                        : ControlKind::absolute);
        if (spec.kind == ControlKind::absolute) {
            spec.steps = static_cast<std::uint32_t>(std::min<std::int64_t>(steps, UINT32_MAX));
            spec.centred = centres(field, descriptor);
        }
        fields_.push_back({field, add(std::move(spec))});
    }
}

// Lamps are outputs of the LED page; the nth belongs to the nth button, as nothing in HID says more.
void HidSurface::add_lamps(const HidDescriptor& descriptor) {
    std::vector<std::size_t> buttons;
    for (std::size_t i = 0; i < controls_.size(); ++i)
        if (controls_[i].kind == ControlKind::button) buttons.push_back(i);
    for (const HidField& field : descriptor.fields) {
        if (field.report != HidReport::output || field.page != 0x08 || field.array || lamps_.size() >= buttons.size())
            continue;
        const std::size_t control = buttons[lamps_.size()];
        controls_[control].show = ShowKind::lamp;
        lamps_.push_back({control, field});
    }
    output_.resize(256);
    for (const HidField& field : descriptor.fields) {
        if (field.report != HidReport::output) continue;
        auto& payload = output_[field.report_id];
        payload.resize(std::max<std::size_t>(payload.size(), (field.bit + field.bits + 7) / 8));
    }
}

void HidSurface::say(std::size_t control, double value, std::vector<ControlEvent>& events) {
    if (controls_[control].kind == ControlKind::relative) {
        if (value != 0) events.push_back({ControlEvent::What::moved, control, value});
        return;
    }
    if (said_[control] == value) return;
    // A button that is not held when the surface comes has not been let go.
    const bool first = !said_[control] && controls_[control].kind == ControlKind::button && value == 0;
    said_[control] = value;
    if (!first) events.push_back({ControlEvent::What::moved, control, value});
}

void HidSurface::say_buttons(Bytes bits, std::size_t first, std::size_t count, std::vector<ControlEvent>& events) {
    for (std::size_t i = 0; i < count && i / 8 < bits.size(); ++i) say(first + i, bits[i / 8] >> i % 8 & 1, events);
}

bool HidSurface::take(Bytes report, std::vector<ControlEvent>& events) {
    if (known_ != nullptr) return (this->*known_->take)(report, events);
    if (report.empty()) return false;
    const std::uint8_t id = numbered_ ? report[0] : 0;
    const Bytes payload = numbered_ ? report.subspan(1) : report;
    bool mine = false;
    std::map<std::size_t, bool> pressed;  // of arrays, which may have several fields of the same buttons
    for (const ReportField& heard : fields_) {
        const HidField& field = heard.field;
        if (field.report_id != id || !has_hid_field(field, payload)) continue;
        mine = true;
        const std::int64_t raw = hid_value(field, payload);
        if (field.array) {
            for (std::size_t usage = 0; usage <= static_cast<std::size_t>(field.last_usage - field.usage); ++usage) {
                bool& on = pressed[heard.control + usage];
                on = on || raw - field.logical_min == static_cast<std::int64_t>(usage);
            }
            continue;
        }
        if (raw < field.logical_min || raw > field.logical_max) continue;  // the null state: it says nothing
        const auto from_low = static_cast<double>(raw - field.logical_min);
        const auto whole = static_cast<double>(field.logical_max - field.logical_min);
        say(heard.control, field.relative ? static_cast<double>(raw) : from_low / whole, events);
    }
    for (const auto& [control, on] : pressed) say(control, on ? 1 : 0, events);
    return mine;
}

// [shuttle −7..7][jog, counts and wraps][0][buttons, low byte first]
bool HidSurface::take_shuttle(Bytes report, std::vector<ControlEvent>& events) {
    if (report.size() < 5) return false;
    const int shuttle = std::clamp<int>(static_cast<std::int8_t>(report[0]), -7, 7);
    say(0, (shuttle + 7) / 14.0, events);
    if (jog_) say(1, static_cast<std::int8_t>(static_cast<std::uint8_t>(report[1] - *jog_)), events);
    jog_ = report[1];
    say_buttons(report.subspan(3, 2), 2, known_->buttons, events);
    return true;
}

// [button][rotation, signed]…
bool HidSurface::take_powermate(Bytes report, std::vector<ControlEvent>& events) {
    if (report.size() < 2) return false;
    say(0, static_cast<std::int8_t>(report[1]), events);
    say_buttons(report.first(1), 1, 1, events);
    return true;
}

// 1: three translations (newer devices: rotations too); 2: three rotations; 3: buttons. Each axis is -350..350.
bool HidSurface::take_spacemouse(Bytes report, std::vector<ControlEvent>& events) {
    if (report.empty() || report[0] < 1 || report[0] > 3) return false;
    if (report[0] == 3) {
        say_buttons(report.subspan(1), 6, known_->buttons, events);
        return report.size() > 1;
    }
    if (report.size() < 7) return false;
    const std::size_t first = report[0] == 1 ? 0 : 3, axes = report[0] == 1 && report.size() >= 13 ? 6 : 3;
    for (std::size_t i = 0; i < axes; ++i) {
        const int deflection = std::clamp<int>(static_cast<std::int16_t>(le16(report, 1 + 2 * i)), -350, 350);
        say(first + i, (deflection + 350) / 700.0, events);
    }
    return true;
}

// 1, type, length, then: 0 the keys, 2 the touch strip, 3 the dials (turned where the next byte is 1, else pushed).
bool HidSurface::take_stream_deck_plus(Bytes report, std::vector<ControlEvent>& events) {
    if (report.size() < 5 || report[0] != 1) return false;
    if (report[1] == 0) {
        if (report.size() < 12) return false;
        for (std::size_t i = 0; i < 8; ++i) say(9 + i, report[4 + i] != 0 ? 1 : 0, events);
        return true;
    }
    if (report[1] == 2) {
        if (report.size() < 8) return false;
        say(8, std::min(799, static_cast<int>(le16(report, 6))) / 799.0, events);
        return true;
    }
    if (report[1] != 3 || report.size() < 9) return false;
    for (std::size_t i = 0; i < 4; ++i) {
        if (report[4] == 1)
            say(i, static_cast<std::int8_t>(report[5 + i]), events);
        else
            say(4 + i, report[5 + i] != 0 ? 1 : 0, events);
    }
    return true;
}

// [unit][program switch] then four columns of six keys.
bool HidSurface::take_xkeys(Bytes report, std::vector<ControlEvent>& events) {
    if (report.size() < 6) return false;
    for (std::size_t column = 0; column < 4; ++column)
        for (std::size_t row = 0; row < 6; ++row) say(column * 6 + row, report[2 + column] >> row & 1, events);
    return true;
}

std::vector<std::uint8_t> HidSurface::show(std::size_t control, double value) {
    const bool on = value >= 0.5;
    if (known_ != nullptr && known_->take == &HidSurface::take_powermate && control == 0)
        return {0, static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0, 1.0) * 255.0))};
    if (known_ != nullptr &&
        known_->take == &HidSurface::take_xkeys) {  // backlight: 181, key, 0 off or 1 on; keys step 8 a column
        std::vector<std::uint8_t> report(36);
        report[1] = 181;
        report[2] = static_cast<std::uint8_t>(control / 6 * 8 + control % 6);
        report[3] = on ? 1 : 0;
        return report;
    }
    for (const Lamp& lamp : lamps_) {
        if (lamp.control != control) continue;
        auto& payload = output_[lamp.field.report_id];
        const std::int64_t said = on ? lamp.field.logical_max : lamp.field.logical_min;
        put_hid_value(lamp.field, static_cast<std::uint32_t>(said), payload);
        std::vector<std::uint8_t> report{lamp.field.report_id};
        report.insert(report.end(), payload.begin(), payload.end());
        return report;
    }
    return {};
}

std::vector<std::uint8_t> HidSurface::hello() const {
    if (known_ != nullptr && known_->take == &HidSurface::take_spacemouse) return {4, 1};  // its lamp
    return {};
}

}  // namespace gonio
