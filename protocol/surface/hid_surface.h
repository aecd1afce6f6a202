// A HID surface: reports to what its controls say, values to the output reports that show them. Boxes whose descriptors
// say too little are in a table; all others are read through their report descriptor. Pure.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "protocol/surface/hid_descriptor.h"
#include "protocol/surface/surface_profile.h"

namespace gonio {

// Result: whether a device that nobody named is a surface of controls: joysticks, game pads, multi-axis controllers,
// consumer controls (knobs), vendor pages of surfaces in the table. Keyboards, mice, touch screens and security keys
// are none. of_people: a collection of the same node is one (is_of_people): a keyboard's media keys are no surface.
bool is_control_box(std::uint16_t vendor, std::uint16_t product, std::uint16_t page, std::uint16_t usage,
                    bool of_people = false);
// Result: whether a collection is a keyboard, a pointer, a touch screen or a security key.
bool is_of_people(std::uint16_t page, std::uint16_t usage);

class HidSurface {
public:
    // Errors: of parse_hid_descriptor, "bad_descriptor" too where it has no control at all; never for surfaces of the
    // table.
    static Result<HidSurface> open(std::uint16_t vendor, std::uint16_t product, Bytes descriptor);

    const std::string& name() const { return name_; }  // of the table; else empty
    const std::vector<ControlSpec>& controls() const { return controls_; }
    // Adds what changed since the last report. Result: false where it is none of this surface's reports.
    // report: as hidraw gives it, with its id in front where the device numbers its reports.
    bool take(Bytes report, std::vector<ControlEvent>& events);
    // Result: the output report that shows a value, its id (0 where there are none) in front; empty: it cannot be
    // shown.
    std::vector<std::uint8_t> show(std::size_t control, double value);
    // Result: the report that is sent when the surface comes; empty: none.
    std::vector<std::uint8_t> hello() const;

private:
    struct ReportField {
        HidField field;
        std::size_t control = 0;  // of an array: of its first usage
    };
    struct Known;
    static const Known kKnown[];
    friend bool is_control_box(std::uint16_t, std::uint16_t, std::uint16_t, std::uint16_t, bool);
    static const Known* find_known(std::uint16_t vendor, std::uint16_t product);

    std::size_t add(ControlSpec spec);
    void add_fields(const HidDescriptor& descriptor);
    void add_lamps(const HidDescriptor& descriptor);
    void say(std::size_t control, double value, std::vector<ControlEvent>& events);
    void say_buttons(Bytes bits, std::size_t first, std::size_t count, std::vector<ControlEvent>& events);
    bool take_shuttle(Bytes report, std::vector<ControlEvent>& events);
    bool take_powermate(Bytes report, std::vector<ControlEvent>& events);
    bool take_spacemouse(Bytes report, std::vector<ControlEvent>& events);
    bool take_stream_deck_plus(Bytes report, std::vector<ControlEvent>& events);
    bool take_xkeys(Bytes report, std::vector<ControlEvent>& events);

    const Known* known_ = nullptr;
    std::string name_;
    bool numbered_ = false;
    std::vector<ControlSpec> controls_;
    std::vector<std::optional<double>> said_;  // of each control, to say only what changes
    std::vector<ReportField> fields_;
    struct Lamp {
        std::size_t control;
        HidField field;
    };
    std::vector<Lamp> lamps_;
    std::vector<std::vector<std::uint8_t>> output_;  // by report id: the payload as it was sent last
    std::optional<std::uint8_t> jog_;                // of a shuttle: where its wheel stood
};

}  // namespace gonio
