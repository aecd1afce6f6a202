#include "protocol/patch_toml.h"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <sstream>
#include <stdexcept>

// toml++ asserts on some texts that are no TOML ("[\x1b"): here that is an exception like its others.
namespace gonio {
[[noreturn]] static void toml_assertion() {
    throw std::runtime_error("the text is not TOML");
}
}  // namespace gonio
#define TOML_UNRELEASED_FEATURES 0  // among them keys of any script, whose table has holes
#define TOML_ASSERT(condition) ((condition) ? void() : gonio::toml_assertion())
#define TOML_ASSERT_ASSUME(condition) TOML_ASSERT(condition)
#include <toml++/toml.h>

#include "protocol/patch.h"
#include "protocol/text_bytes.h"

namespace gonio {
namespace {

// Leaves through this exception, inside this file only.
struct Refused {
    Error error;
};

[[noreturn]] void refuse(const toml::source_region& at, std::string value, std::string message) {
    std::string place = "line " + std::to_string(at.begin.line) + " column " + std::to_string(at.begin.column);
    throw Refused{{"bad_patch", std::move(place), std::move(value), std::move(message)}};
}

std::string text_of(const toml::node& node) {
    std::ostringstream text;
    if (const auto* table = node.as_table())
        text << "a table of " << table->size();
    else if (const auto* array = node.as_array())
        text << "an array of " << array->size();
    else
        node.visit([&](const auto& value) {
            if constexpr (toml::is_value<decltype(value)>) text << value;
        });
    return text.str().substr(0, 64);
}

void only_keys(const toml::table& table, std::initializer_list<std::string_view> known, std::string_view what) {
    for (const auto& [key, node] : table) {
        bool found = false;
        for (const std::string_view name : known) found = found || key.str() == name;
        if (!found) refuse(key.source(), std::string(key.str()), "is no key of " + std::string(what));
    }
}

std::uint32_t whole_number(const toml::node& node, std::int64_t low, std::int64_t high, const char* what) {
    const auto value = node.as_integer();
    if (value == nullptr || value->get() < low || value->get() > high)
        refuse(
            node.source(), text_of(node),
            std::string(what) + " must be a whole number from " + std::to_string(low) + " to " + std::to_string(high));
    return static_cast<std::uint32_t>(value->get());
}

std::string word(const toml::node& node, const char* what) {
    const auto value = node.as_string();
    if (value == nullptr) refuse(node.source(), text_of(node), std::string(what) + " must be a string");
    return value->get();
}

struct Range {
    double low, high;
};

// In the unit that people write, to SI.
Range range_of(const toml::node& node, const PropertyRow& property) {
    const auto* array = node.as_array();
    Range range{};
    bool good = array != nullptr && array->size() == 2;
    for (std::size_t i = 0; good && i < 2; ++i) {
        const auto value = (*array)[i].value<double>();
        good = value && std::isfinite(*value);
        if (good) (i == 0 ? range.low : range.high) = *value * property.unit;
    }
    if (!good) refuse(node.source(), text_of(node), "a range is two numbers: [low, high]");
    return range;
}

void read_fixture(const toml::table& table, v1::SetPatch& patch) {
    only_keys(table, {"sacn", "artnet", "address", "target", "channels", "range", "profiles"}, "[[patch]]");
    const toml::node *sacn = table.get("sacn"), *artnet = table.get("artnet");
    if ((sacn == nullptr) == (artnet == nullptr))
        refuse(table.source(), "", "a patch needs either sacn = UNIVERSE or artnet = UNIVERSE");
    const toml::node *address = table.get("address"), *channels = table.get("channels"), *target = table.get("target");
    if (address == nullptr) refuse(table.source(), "", "a patch needs an address");
    if (channels == nullptr || !channels->is_array())
        refuse(table.source(), "", "a patch needs channels = [\"level\", …]");
    const toml::table* ranges = nullptr;
    if (const toml::node* node = table.get("range")) {
        ranges = node->as_table();
        if (ranges == nullptr) refuse(node->source(), text_of(*node), "range is a table: range.pan = [-180, 180]");
        for (const auto& [key, value] : *ranges) {
            const PropertyRow* property = find_property(key.str());
            if (property == nullptr) refuse(key.source(), std::string(key.str()), "is no property");
            range_of(value, *property);
        }
    }
    v1::PatchRow row;
    row.set_protocol(sacn != nullptr ? "sacn" : "artnet");
    row.set_universe(sacn != nullptr ? whole_number(*sacn, 1, 63999, "an sACN universe")
                                     : whole_number(*artnet, 0, 32767, "an Art-Net port-address"));
    std::uint32_t slot = whole_number(*address, 1, 512, "an address");
    const std::string name = target != nullptr ? word(*target, "target") : "";
    for (const toml::node& node : *channels->as_array()) {
        std::string channel = word(node, "a channel");
        if (channel == "-") {  // a slot that nothing here listens to
            ++slot;
            continue;
        }
        std::uint32_t bits = 8;
        if (const std::size_t colon = channel.find(':'); colon != std::string::npos) {
            if (channel.substr(colon) == ":16")
                bits = 16;
            else if (channel.substr(colon) != ":8")
                refuse(node.source(), channel, "a channel has 8 or 16 bits: \"pan:16\"");
            channel.resize(colon);
        }
        const PropertyRow* property = find_property(channel);
        if (property == nullptr) refuse(node.source(), channel, "is no property");
        v1::PatchRow& added = *patch.add_rows();
        added = row;
        added.set_address(slot);
        added.set_bits(bits);
        added.set_property(channel);
        if (!property->of_scene) added.set_target(name);
        if (ranges != nullptr) {
            if (const toml::node* given = ranges->get(channel)) {
                const Range range = range_of(*given, *property);
                added.set_low(range.low);
                added.set_high(range.high);
            }
        }
        if (property->property == Property::profile) {
            const toml::node* list = table.get("profiles");
            if (list == nullptr || !list->is_array()) refuse(node.source(), channel, "needs profiles = [NAME, …]");
            for (const toml::node& profile : *list->as_array()) added.add_profiles(word(profile, "a profile"));
        }
        if (patch.rows_size() > static_cast<int>(kMaxPatchRows))
            throw Refused{
                {"too_large", "channels", std::to_string(patch.rows_size()), "a patch has at most 4,096 rows"}};
        // Checked here, where the place in the file is still known.
        v1::SetPatch alone;
        *alone.add_rows() = added;
        if (const auto checked = check_patch(alone); !checked)
            refuse(node.source(), channel + (checked.error().value.empty() ? "" : " " + checked.error().value),
                   checked.error().message);
        slot += property->values * (bits / 8);
    }
}

// toml++ walks keys and values as deep as they nest, on the stack: deeper files are refused before it sees them.
// A patch file nests three deep.
class Depth {
public:
    // c: a character outside strings and comments. Result: whether it may follow.
    bool take(char c) {
        if (c == '.') return ++dots_ <= kMostDots;
        if (c == '[' || c == '{') return dots_ = 0, ++open_ <= kMostOpen;
        if ((c == ']' || c == '}') && open_ > 0) --open_;
        if (c == '\n' || c == ',' || c == '=') dots_ = 0;
        return true;
    }

private:
    static constexpr int kMostDots = 8, kMostOpen = 8;
    int dots_ = 0;  // of the key, or number, that we are in
    int open_ = 0;  // brackets and braces
};

// Result: a TOML basic string.
std::string quoted(const std::string& text) {
    std::string result = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') result += '\\';
        if (static_cast<unsigned char>(c) >= 0x20 && c != 0x7F) {
            result += c;
            continue;
        }
        char escape[8];
        std::snprintf(escape, sizeof escape, "\\u%04X", static_cast<unsigned>(c));
        result += escape;
    }
    return result + "\"";
}

std::string number(double value) {
    char text[40];
    const auto [end, error] = std::to_chars(text, text + sizeof text, value);
    return std::string(text, end);
}

// Result: the same TOML in ASCII: characters of double-quoted strings and comments become \UXXXXXXXX, others and
// control characters are refused. toml++ 3.3 runs into undefined behaviour on some of them where they do not belong.
Result<std::string> ascii_toml(std::string_view text) {
    const Bytes bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    std::string ascii;
    std::size_t line = 1, column = 1;
    std::string_view until;  // what ends the string or comment that we are in; empty: in none
    Depth depth;
    for (std::size_t at = 0; at < text.size();) {
        const char c = text[at];
        const bool control = (bytes[at] < 0x20 && c != '\t' && c != '\n' && c != '\r') || bytes[at] == 0x7F;
        std::size_t step = control ? 0 : utf8_length(bytes, at);
        if (step > 1 && (until.empty() || until.front() == '\'')) step = 0;
        if (step == 0)
            return Error{"bad_patch", "line " + std::to_string(line) + " column " + std::to_string(column),
                         std::to_string(bytes[at]),
                         "a patch file is ASCII without control characters, but for UTF-8 in double-quoted strings and "
                         "comments"};
        if (step > 1) {
            std::uint32_t code = bytes[at] & (0x7Fu >> step);
            for (std::size_t i = 1; i < step; ++i) code = code << 6 | (bytes[at + i] & 0x3Fu);
            char escape[16];
            std::snprintf(escape, sizeof escape, "\\U%08X", static_cast<unsigned>(code));
            ascii += escape;
        } else {
            if (c == '\n') depth.take(c);  // also at the end of a comment
            if (until.empty()) {
                if (!depth.take(c))
                    return Error{"bad_patch", "line " + std::to_string(line) + " column " + std::to_string(column),
                                 std::string(1, c), "keys and values of a patch file do not nest so deeply"};
                if (c == '#') until = "\n";
                if (c == '"' || c == '\'') {
                    const std::string_view three = c == '"' ? "\"\"\"" : "\'\'\'";
                    until = text.substr(at).starts_with(three) ? three : three.substr(0, 1);
                    step = until.size();
                }
            } else if (until.front() == '"' && c == '\\' && at + 1 < text.size() &&
                       (text[at + 1] == '"' || text[at + 1] == '\\')) {
                step = 2;
            } else if (text.substr(at).starts_with(until) || (c == '\n' && until.size() == 1)) {
                step = c == '\n' ? 1 : until.size();
                until = {};
            }
            ascii += text.substr(at, step);
        }
        column = c == '\n' ? 1 : column + step;
        line += c == '\n' ? 1 : 0;
        at += step;
    }
    return ascii;
}

}  // namespace

Result<v1::SetPatch> read_patch_toml(std::string_view text) {
    if (text.size() > kMaxPatchFileBytes)
        return Error{"too_large", "", std::to_string(text.size()) + " bytes", "a patch file has at most 1 MiB"};
    const Result<std::string> ascii = ascii_toml(text);
    if (!ascii) return ascii.error();
    try {
        const toml::table file = toml::parse(*ascii);
        only_keys(file, {"patch"}, "a patch file");
        v1::SetPatch patch;
        const toml::node* list = file.get("patch");
        if (list == nullptr) return patch;  // an empty file patches nothing
        if (!list->is_array_of_tables()) refuse(list->source(), "patch", "write [[patch]], one for each fixture");
        for (const toml::node& node : *list->as_array()) read_fixture(*node.as_table(), patch);
        return patch;
    } catch (const toml::parse_error& error) {
        const auto& at = error.source().begin;
        return Error{"bad_patch", "line " + std::to_string(at.line) + " column " + std::to_string(at.column), "",
                     std::string(error.description())};
    } catch (const Refused& refused) {
        return refused.error;
    } catch (const std::runtime_error& error) {
        return Error{"bad_patch", "", "", error.what()};
    }
}

std::string write_patch_toml(const v1::Patch& patch) {
    std::string text;
    for (const v1::PatchRow& row : patch.rows()) {
        const PropertyRow& property = *find_property(row.property());
        text += "[[patch]]\n" + row.protocol() + " = " + std::to_string(row.universe()) +
                "\naddress = " + std::to_string(row.address()) + "\n";
        if (!row.target().empty()) text += "target = " + quoted(row.target()) + "\n";
        text += "channels = [\"" + row.property() + (row.bits() == 16 ? ":16" : "") + "\"]\n";
        if (row.has_low() || row.has_high())
            text += "range." + row.property() + " = [" +
                    number((row.has_low() ? row.low() : property.low) / property.unit) + ", " +
                    number((row.has_high() ? row.high() : property.high) / property.unit) + "]\n";
        if (row.profiles_size() > 0) {
            text += "profiles = [";
            for (int i = 0; i < row.profiles_size(); ++i) text += (i > 0 ? ", " : "") + quoted(row.profiles(i));
            text += "]\n";
        }
        text += "\n";
    }
    return text;
}

}  // namespace gonio
