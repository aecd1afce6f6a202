#include "protocol/surface/qxi.h"

#include <algorithm>
#include <pugixml.hpp>
#include <set>

#include "protocol/schema/surface.pb.h"
#include "protocol/surface/surface_toml.h"
#include "protocol/text/text_bytes.h"

namespace gonio {
namespace {

Error bad(const std::string& where, std::string value, std::string message) {
    return {"bad_surface", where, std::move(value), std::move(message)};
}

// Number: the MIDI channel in bits 12 to 15, then QLC+'s own count of messages (its midiprotocol.h).
std::optional<MidiKey> key_of_number(unsigned number) {
    MidiKey key;
    key.channel = static_cast<std::uint8_t>((number >> 12) + 1);
    const unsigned message = number & 0x0FFF;
    if (message < 128)
        key.kind = MidiKind::cc;
    else if (message < 256)
        key.kind = MidiKind::note;
    else if (message < 384)
        key.kind = MidiKind::poly;
    else if (message == 512)
        key.kind = MidiKind::pressure;
    else if (message == 513)
        key.kind = MidiKind::bend;
    else
        return std::nullopt;  // programs and clocks are no controls
    if (message < 384) key.number = static_cast<std::uint8_t>(message % 128);
    return key;
}

std::string printable(std::string_view text) {
    return shortened_text(text, text.size()).substr(0, 60);
}

// What QLC+ calls 0..255, as the 7 bits that a surface is sent.
std::uint8_t feedback_value(pugi::xml_attribute attribute, unsigned otherwise) {
    return static_cast<std::uint8_t>(std::min(attribute.as_uint(otherwise), 255u) / 2);
}

}  // namespace

// One document, element by element.
Result<SurfaceProfile> read_qxi(std::string_view text) {
    if (text.size() > kMaxSurfaceFileBytes)
        return Error{"too_large", "", std::to_string(text.size()) + " bytes", "an input profile has at most 1024 KiB"};
    pugi::xml_document document;
    const auto parsed = document.load_buffer(text.data(), text.size());
    if (!parsed)
        return bad("byte " + std::to_string(parsed.offset), "", std::string("not XML: ") + parsed.description());
    const pugi::xml_node root = document.child("InputProfile");
    if (!root) return bad("byte 0", shown_text(document.first_child().name()), "not an input profile of QLC+");
    const std::string type = root.child("Type").text().as_string("MIDI");
    if (type != "MIDI")
        return Error{"unsupported", "Type", shown_text(type), "only input profiles of MIDI boxes can be used"};
    SurfaceProfile profile;
    profile.name = printable(std::string(root.child("Manufacturer").text().as_string()) + " " +
                             root.child("Model").text().as_string());
    const auto channels = root.children("Channel");
    // Recorded without the channel, every number has 0 there: then it stands for any.
    const bool any_channel = std::none_of(channels.begin(), channels.end(), [](pugi::xml_node channel) {
        return channel.attribute("Number").as_uint() >> 12 != 0;
    });
    std::set<std::string> names;
    std::set<MidiKey> inputs;
    unsigned sliders = 0;
    for (const pugi::xml_node channel : channels) {
        const std::string number_text = channel.attribute("Number").as_string();
        const unsigned number = channel.attribute("Number").as_uint(0x10000);
        if (number > 0xFFFF) return bad("Channel", shown_text(number_text), "a channel's number is 0 to 65535");
        auto key = key_of_number(number);
        if (!key) continue;
        if (any_channel) key->channel = 0;
        if (!inputs.insert(*key).second) continue;  // the first of two counts, as in QLC+
        if (profile.controls.size() >= kMaxSurfaceControls)
            return Error{"too_large", "Channel", shown_text(number_text), "a box has at most 1,024 controls"};
        const std::string kind = channel.child("Type").text().as_string();
        ControlSpec spec;
        spec.input = spec.output = *key;
        spec.name = printable(channel.child("Name").text().as_string());
        if (spec.name.empty()) spec.name = midi_key_text(*key);
        if (!names.insert(spec.name).second) {
            spec.name += " (" + midi_key_text(*key) + ")";
            if (!names.insert(spec.name).second) continue;
        }
        const bool button = kind == "Button" || kind == "Next Page" || kind == "Previous Page" || kind == "Page Set";
        const bool relative = std::string_view(channel.child("Movement").text().as_string()) == "Relative";
        const pugi::xml_node feedback =
            channel.child("Feedback") ? channel.child("Feedback") : channel.child("Feedbacks");
        spec.kind = button ? ControlKind::button : relative ? ControlKind::relative : ControlKind::absolute;
        spec.code = RelativeCode::offset_64;
        if (spec.kind == ControlKind::absolute) spec.steps = key->kind == MidiKind::bend ? 16383 : 127;
        if (button) {
            spec.show = ShowKind::lamp;
            spec.off = feedback_value(feedback.attribute("LowerValue"), 0);
            spec.on = feedback_value(feedback.attribute("UpperValue"), 255);
        } else if (key->kind == MidiKind::bend) {
            spec.show = ShowKind::motor;
            spec.deadband_ratio = 16.0 / 16383;  // such faders measure 10 bits
        }
        v1::SurfaceRow row;
        row.set_device("*");
        row.set_control(spec.name);
        if (kind == "Slider" && spec.kind == ControlKind::absolute) {
            row.set_target("#" + std::to_string(++sliders));
            row.set_property("level");
            row.set_stride(8);
        } else if (kind == "Next Page" || kind == "Previous Page") {
            row.set_property("page");
            row.set_step(kind == "Next Page" ? 1 : -1);
        }
        if (!row.property().empty()) profile.rows.push_back(std::move(row));
        profile.controls.push_back(std::move(spec));
    }
    if (profile.controls.empty()) return bad("", "", "the input profile has no control");
    return profile;
}

}  // namespace gonio
