// What the readers of fader boxes promise, whatever the bytes. Shared by the fuzz targets and their replay test.
#pragma once

#include <cmath>
#include <set>
#include <string_view>

#include "protocol/schema/cue_number.h"
#include "protocol/surface/hid_surface.h"
#include "protocol/surface/midi_surface.h"
#include "protocol/surface/qxi.h"
#include "protocol/surface/surface_map.h"
#include "protocol/surface/surface_toml.h"
#include "tests/fuzz/require.h"

namespace gonio::fuzz {

inline void check_events(const std::vector<ControlEvent>& events, const std::vector<ControlSpec>& controls) {
    for (const ControlEvent& event : events) {
        require(event.control < controls.size() && std::isfinite(event.value));
        if (controls[event.control].kind != ControlKind::relative) require(event.value >= 0 && event.value <= 1);
    }
}

inline void check_controls(const std::vector<ControlSpec>& controls) {
    require(controls.size() <= kMaxSurfaceControls);
    for (const ControlSpec& control : controls) {
        require(!control.name.empty() && control.name.size() <= 128);
        if (control.kind == ControlKind::absolute) require(control.steps > 0);
    }
}

inline void check_box(const SurfaceProfile& profile, Bytes bytes) {
    check_controls(profile.controls);
    std::set<std::string> names;
    for (const ControlSpec& control : profile.controls) require(names.insert(control.name).second);
    for (const v1::SurfaceRow& row : profile.rows) {
        require(static_cast<bool>(check_surface_row(row, "")));
        v1::SurfaceRow again;
        require(again.ParseFromString(row.SerializeAsString()));
    }
    MidiSurface box(profile);
    std::vector<MidiMessage> messages;
    MidiStream stream;
    MidiSystem system;
    read_usb_midi(bytes, messages, &system);
    stream.take(bytes, messages);
    for (const MidiNews& news : {system.take_news(), stream.take_news()}) {
        require(!news.timecode || is_timecode(*news.timecode));
        require(news.cues.size() <= kMaxMidiCues && news.ignored.size() <= kMaxIgnoredKinds);
        for (const std::string& cue : news.cues) require(cue == "go" || parse_cue_number(cue).has_value());
    }
    std::int64_t now_ns = 1;
    for (const MidiMessage& message : messages) {
        std::vector<ControlEvent> events;
        box.take(message, now_ns += 1'000'000, events);
        box.tick(now_ns, events);
        check_events(events, box.controls());
        require((key_of(message).channel >= 1 || message.status == kVolume) && value_of(message) <= 16383);
    }
    check_controls(box.controls());
    for (std::size_t i = 0; i < box.controls().size(); ++i) {
        const std::vector<std::uint8_t> shown = box.show(i, 0.7);
        const bool sysex = !shown.empty() && shown.front() == 0xF0;
        for (std::size_t at = 1; at + (sysex ? 1 : 0) < shown.size(); ++at) require(shown[at] < 0x80);
        require(usb_midi_packets(box.show_cable(i), shown).size() % 4 == 0);
    }
}

inline void check_midi(Bytes bytes) {
    check_box({}, bytes);
}

// The first bytes choose a device; then a descriptor after its length; the rest are reports of 16 bytes and less.
inline void check_hid(Bytes bytes) {
    if (bytes.size() < 6) return;
    const auto vendor = be16(bytes, 0), product = be16(bytes, 2);
    const std::size_t size = std::min<std::size_t>(be16(bytes, 4), bytes.size() - 6);
    auto box = HidSurface::open(vendor, product, bytes.subspan(6, size));
    if (!box) return require(!box.error().code.empty() && !box.error().message.empty());
    check_controls(box->controls());
    for (Bytes rest = bytes.subspan(6 + size); !rest.empty();) {
        const std::size_t length = std::min<std::size_t>(rest[0] % 17, rest.size() - 1);
        std::vector<ControlEvent> events;
        box->take(rest.subspan(1, length), events);
        check_events(events, box->controls());
        rest = rest.subspan(1 + length);
    }
    for (std::size_t i = 0; i < box->controls().size(); ++i) require(box->show(i, 1).size() <= 4097);
}

inline void check_files(std::string_view text) {
    const Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    if (const auto profile = read_surface_profile(text)) check_box(*profile, bytes);
    if (const auto profile = read_qxi(text)) check_box(*profile, bytes);
    const auto map = read_surfaces_toml(text);
    if (!map) return require(!map.error().code.empty() && !map.error().message.empty());
    require(static_cast<bool>(check_surfaces(*map)));
}

}  // namespace gonio::fuzz
