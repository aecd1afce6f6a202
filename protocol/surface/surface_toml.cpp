#include "protocol/surface/surface_toml.h"

#include <algorithm>
#include <set>

#include "protocol/schema/property.h"
#include "protocol/schema/surface.pb.h"
#include "protocol/surface/surface_map.h"
#include "protocol/text/text_bytes.h"
#include "protocol/text/toml_read.h"

namespace gonio {
namespace {

using namespace toml_read;

constexpr std::size_t kMaxHelloBytes = 256;

// What both kinds of file say about how a control drives.
void read_manner(const toml::table& table, v1::SurfaceRow& row) {
    const PropertyRow* property = find_property(row.property());
    if (const toml::node* node = table.get("range")) {
        const Range written = range(*node);
        const double unit = property != nullptr ? property->unit : 1;
        row.set_low(written.low * unit);
        row.set_high(written.high * unit);
    }
    if (const toml::node* node = table.get("mode")) row.set_mode(word(*node, "mode"));
    if (const toml::node* node = table.get("curve")) row.set_curve(word(*node, "curve"));
    if (const toml::node* node = table.get("takeover")) row.set_takeover(word(*node, "takeover"));
    if (const toml::node* node = table.get("smooth_s")) row.set_smooth_s(number(*node, "smooth_s"));
    if (const toml::node* node = table.get("step")) row.set_step(number(*node, "step"));
    if (const toml::node* node = table.get("stride")) row.set_stride(whole_number(*node, 0, 64, "stride"));
}

Result<std::vector<std::uint8_t>> read_hex(const std::string& text) {
    std::vector<std::uint8_t> bytes;
    int half = -1;
    for (const char c : text) {
        if (c == ' ' && half < 0) continue;
        const int value = hex_digit(c);
        if (value < 0 || bytes.size() == kMaxHelloBytes) return Error{};
        if (half < 0) {
            half = value;
            continue;
        }
        bytes.push_back(static_cast<std::uint8_t>(half << 4 | value));
        half = -1;
    }
    const bool sysex = half < 0 && bytes.size() >= 2 && bytes.front() == 0xF0 && bytes.back() == 0xF7 &&
                       std::none_of(bytes.begin() + 1, bytes.end() - 1, [](std::uint8_t b) { return b >= 0x80; });
    if (!sysex) return Error{};
    return bytes;
}

std::vector<MidiKey> keys_at(const toml::node& node) {
    auto keys = parse_midi_keys(word(node, "messages"));
    if (!keys) refuse(node.source(), keys.error().value, keys.error().message);
    return *keys;
}

ControlKind kind_at(const toml::table& table, const MidiKey& first) {
    const toml::node* node = table.get("kind");
    if (node == nullptr) return first.kind == MidiKind::note ? ControlKind::button : ControlKind::absolute;
    const std::string name = word(*node, "kind");
    for (const ControlKind kind : {ControlKind::absolute, ControlKind::relative, ControlKind::button})
        if (name == control_kind_name(kind)) return kind;
    refuse(node->source(), name, "kind must be absolute, relative or button");
}

RelativeCode code_at(const toml::table& table) {
    const toml::node* node = table.get("clicks");
    if (node == nullptr) return RelativeCode::twos_complement;
    const std::string name = word(*node, "clicks");
    if (name == "twos-complement") return RelativeCode::twos_complement;
    if (name == "sign-bit") return RelativeCode::sign_bit;
    if (name == "offset-64") return RelativeCode::offset_64;
    refuse(node->source(), name, "clicks must be twos-complement, sign-bit or offset-64");
}

ShowKind show_at(const toml::node& node) {
    const std::string name = word(node, "show");
    if (name == "lamp") return ShowKind::lamp;
    if (name == "value") return ShowKind::value;
    if (name == "ring-mcu") return ShowKind::ring_mcu;
    if (name == "motor") return ShowKind::motor;
    refuse(node.source(), name, "show must be lamp, value, ring-mcu or motor");
}

// A list of keys of the same length as the inputs, for touch and show.
std::vector<MidiKey> keys_beside(const toml::table& table, const char* key, std::size_t count) {
    const toml::node& node = *table.get(key);
    std::vector<MidiKey> keys = keys_at(node);
    if (keys.size() != count)
        refuse(node.source(), std::to_string(keys.size()),
               "needs as many messages as there are inputs: " + std::to_string(count));
    return keys;
}

// "level #n" -> property and target of the nth control.
void read_drives(const toml::node& node, std::size_t n, v1::SurfaceRow& row) {
    const std::string text = word(node, "drives");
    const std::size_t space = text.find(' ');
    row.set_property(text.substr(0, space));
    if (space == text.npos) return;
    std::string target = text.substr(space + 1);
    if (target == "#n") target = "#" + std::to_string(n + 1);
    row.set_target(target);
}

bool is_usb_id(const std::string& text) {
    const auto digits = [](std::string_view part) { return part.find_first_not_of("0123456789abcdef") == part.npos; };
    const std::string_view all = text;
    return all.size() == 9 && all[4] == ':' && digits(all.substr(0, 4)) && digits(all.substr(5));
}

void read_controls(const toml::table& table, SurfaceProfile& profile) {
    only_keys(table,
              {"name", "inputs", "kind", "bits", "clicks", "noise", "touch", "show", "on", "off", "output", "drives",
               "range", "mode", "curve", "takeover", "smooth_s", "step", "stride"},
              "[[control]]");
    const toml::node *name = table.get("name"), *inputs = table.get("inputs");
    if (name == nullptr) refuse(table.source(), "", "a control needs a name");
    if (inputs == nullptr) refuse(table.source(), "", "a control needs its inputs: inputs = \"cc 1/0-7\"");
    const std::vector<MidiKey> keys = keys_at(*inputs);
    ControlSpec spec;
    spec.kind = kind_at(table, keys.front());
    spec.code = code_at(table);
    if (const toml::node* node = table.get("bits")) {
        const std::uint32_t bits = whole_number(*node, 7, 14, "bits");
        if (bits != 7 && bits != 14) refuse(node->source(), text_of(*node), "bits is 7 or 14");
        if (bits == 14 && keys.front().kind != MidiKind::cc && keys.front().kind != MidiKind::bend)
            refuse(node->source(), "14", "only controllers and pitch bend have 14 bits");
        spec.pair = bits == 14 && keys.front().kind == MidiKind::cc;
        if (spec.pair && std::any_of(keys.begin(), keys.end(), [](const MidiKey& key) { return key.number > 31; }))
            refuse(node->source(), "14", "only controllers 0 to 31 have a fine half");
    }
    if (spec.kind == ControlKind::absolute) spec.steps = spec.pair || keys.front().kind == MidiKind::bend ? 16383 : 127;
    if (const toml::node* node = table.get("noise")) {
        const double noise = number(*node, "noise");
        if (!(noise >= 0 && noise <= spec.steps / 2.0))
            refuse(node->source(), text_of(*node), "noise is a number of steps");
        if (spec.steps > 0) spec.deadband_ratio = noise / spec.steps;
    }
    if (const toml::node* node = table.get("show")) spec.show = show_at(*node);
    if (const toml::node* node = table.get("on"))
        spec.on = static_cast<std::uint8_t>(whole_number(*node, 0, 127, "on"));
    if (const toml::node* node = table.get("off"))
        spec.off = static_cast<std::uint8_t>(whole_number(*node, 0, 127, "off"));
    const std::vector<MidiKey> outputs = table.get("output") ? keys_beside(table, "output", keys.size()) : keys;
    const std::vector<MidiKey> touches =
        table.get("touch") ? keys_beside(table, "touch", keys.size()) : std::vector<MidiKey>{};
    const std::string plain = word(*name, "name");
    for (std::size_t i = 0; i < keys.size(); ++i) {
        spec.name = keys.size() == 1 ? plain : plain + " " + std::to_string(i + 1);
        spec.input = keys[i];
        spec.output = outputs[i];
        if (!touches.empty()) spec.touch = touches[i];
        if (profile.controls.size() >= kMaxSurfaceControls)
            refuse({"too_large", "control", "", "a box has at most 1,024 controls"});
        profile.controls.push_back(spec);
        const toml::node* drives = table.get("drives");
        if (drives == nullptr) continue;
        v1::SurfaceRow row;
        row.set_device("*");
        row.set_control(spec.name);
        read_drives(*drives, i, row);
        read_manner(table, row);
        if (row.property() == kPageProperty && row.has_low()) refuse(drives->source(), "range", "a page has no range");
        if (const auto checked = check_surface_row(row, ""); !checked)
            refuse(drives->source(), checked.error().where + " " + checked.error().value, checked.error().message);
        profile.rows.push_back(std::move(row));
    }
}

// The names and the messages, fine halves too, of the controls from `first` on are nobody's yet. table: where they
// stand.
void check_controls(const toml::table& table, const SurfaceProfile& profile, std::size_t first) {
    const auto messages = [](const ControlSpec& control) {
        std::vector<MidiKey> keys = {*control.input};
        if (control.pair)
            keys.push_back({control.input->cable, MidiKind::cc, control.input->channel,
                            static_cast<std::uint8_t>(control.input->number + 32)});
        return keys;
    };
    std::set<std::string> names;
    std::set<MidiKey> inputs;
    for (std::size_t i = 0; i < profile.controls.size(); ++i) {
        const ControlSpec& control = profile.controls[i];
        if (control.name.empty() || control.name.size() > 64)
            refuse(table.get("name")->source(), shown_text(control.name), "names have 1 to 64 bytes");
        if (!names.insert(control.name).second && i >= first)
            refuse(table.get("name")->source(), control.name, "two controls have this name");
        for (const MidiKey& key : messages(control)) {
            if (!inputs.insert(key).second && i >= first)
                refuse(table.get("inputs")->source(), midi_key_text(key),
                       "two controls have this message (of 14 bits n and n + 32 are one)");
        }
    }
}

// Result: where the key stands that a check of the row named; else the row.
toml::source_region at_fault(const toml::table& table, const std::string& field) {
    const std::string key = field == "device"                   ? "box"
                            : field == "low" || field == "high" ? "range"
                            : field == "deadband_ratio"         ? "deadband"
                                                                : field;
    const toml::node* node = table.get(key);
    return node != nullptr ? node->source() : table.source();
}

void read_row(const toml::table& table, v1::SetSurfaces& map) {
    only_keys(table,
              {"box", "control", "target", "property", "range", "mode", "curve", "takeover", "smooth_s", "deadband",
               "step", "page", "to_page", "stride", "profiles", "gels", "preset", "fade_s", "cue"},
              "[[control]]");
    v1::SurfaceRow row;
    const auto text = [&](const char* key, const char* otherwise) {
        const toml::node* node = table.get(key);
        return node != nullptr ? word(*node, key) : std::string(otherwise);
    };
    row.set_device(text("box", "*"));
    row.set_control(text("control", ""));
    row.set_target(text("target", ""));
    row.set_property(text("property", ""));
    row.set_preset(text("preset", ""));
    row.set_cue(text("cue", ""));
    read_manner(table, row);
    if (const toml::node* node = table.get("deadband")) row.set_deadband_ratio(number(*node, "deadband"));
    if (const toml::node* node = table.get("page")) row.set_page(whole_number(*node, 1, kMaxSurfacePages, "page"));
    if (const toml::node* node = table.get("to_page"))
        row.set_high(whole_number(*node, 1, kMaxSurfacePages, "to_page"));
    if (const toml::node* node = table.get("fade_s")) row.set_fade_s(number(*node, "fade_s"));
    for (const char* key : {"profiles", "gels"}) {
        const toml::node* node = table.get(key);
        if (node == nullptr) continue;
        const toml::array* list = node->as_array();
        if (list == nullptr) refuse(node->source(), text_of(*node), std::string(key) + " = [NAME, …]");
        for (const toml::node& name : *list) row.add_profiles(word(name, "a name"));
    }
    if (static_cast<std::size_t>(map.rows_size()) >= kMaxSurfaceRows)
        refuse({"too_large", "control", std::to_string(map.rows_size()), "there are at most 4,096 rows"});
    if (const auto checked = check_surface_row(row, ""); !checked)
        refuse(at_fault(table, checked.error().where),
               checked.error().where + (checked.error().value.empty() ? "" : " " + checked.error().value),
               checked.error().message);
    *map.add_rows() = std::move(row);
}

const toml::array* tables(const toml::table& file, const char* key, const char* wanted) {
    const toml::node* list = file.get(key);
    if (list == nullptr) return nullptr;
    if (!list->is_array_of_tables()) refuse(list->source(), key, wanted);
    return list->as_array();
}

}  // namespace

Result<SurfaceProfile> read_surface_profile(std::string_view text) {
    SurfaceProfile profile;
    const auto done = read({text, kMaxSurfaceFileBytes, "bad_surface", "a profile"}, [&](const toml::table& file) {
        only_keys(file, {"name", "usb", "hello", "repaint_s", "control"}, "a profile");
        if (const toml::node* node = file.get("name")) profile.name = word(*node, "name");
        if (profile.name.empty()) refuse(file.source(), "", "a profile needs a name");
        if (const toml::node* node = file.get("usb")) {
            const toml::array* list = node->as_array();
            if (list == nullptr) refuse(node->source(), text_of(*node), "usb = [\"0944:0117\"]");
            for (const toml::node& id : *list) {
                profile.usb.push_back(word(id, "usb"));
                if (!is_usb_id(profile.usb.back()))
                    refuse(id.source(), shown_text(profile.usb.back()),
                           "is no VENDOR:PRODUCT of four hexadecimal digits each, in small letters");
            }
        }
        if (const toml::node* node = file.get("hello")) {
            const auto bytes = read_hex(word(*node, "hello"));
            if (!bytes) refuse(node->source(), text_of(*node), "hello is a SysEx of hexadecimal bytes, \"F0 … F7\"");
            profile.hello = *bytes;
        }
        if (const toml::node* node = file.get("repaint_s")) {
            profile.repaint_s = number(*node, "repaint_s");
            if (!(profile.repaint_s >= 0.1 && profile.repaint_s <= 60))
                refuse(node->source(), text_of(*node), "repaint_s is 0.1 to 60");
        }
        if (const toml::array* list = tables(file, "control", "write [[control]], one for each kind of control"))
            for (const toml::node& node : *list) {
                const std::size_t first = profile.controls.size();
                read_controls(*node.as_table(), profile);
                check_controls(*node.as_table(), profile, first);
            }
    });
    if (!done) return done.error();
    return profile;
}

Result<v1::SetSurfaces> read_surfaces_toml(std::string_view text) {
    v1::SetSurfaces map;
    map.set_with_default(true);
    const auto done = read({text, kMaxSurfaceFileBytes, "bad_surface", "a map"}, [&](const toml::table& file) {
        only_keys(file, {"default", "control"}, "a map");
        if (const toml::node* node = file.get("default")) map.set_with_default(yes_or_no(*node, "default"));
        if (const toml::array* list = tables(file, "control", "write [[control]], one for each control"))
            for (const toml::node& node : *list) read_row(*node.as_table(), map);
    });
    if (!done) return done.error();
    return map;
}

}  // namespace gonio
