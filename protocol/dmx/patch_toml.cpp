#include "protocol/dmx/patch_toml.h"

#include "ies/core/number_text.h"
#include "protocol/dmx/patch.h"
#include "protocol/schema/console.pb.h"
#include "protocol/text/toml_read.h"

namespace gonio {
namespace {

using namespace toml_read;

// [[from, to, low, high], …]: parts of the slot's values, and what they stand for in the unit that people write.
void read_ranges(const toml::node& node, const PropertyRow& property, v1::PatchRow& row) {
    const char* const kForm = "ranges are [[from, to, low, high], …]";
    if (!node.is_array()) refuse(node.source(), text_of(node), kForm);
    for (const toml::node& one : *node.as_array()) {
        const toml::array* four = one.as_array();
        if (four == nullptr || four->size() != 4) refuse(one.source(), text_of(one), kForm);
        v1::PatchRange& range = *row.add_ranges();
        range.set_from(whole_number((*four)[0], 0, 65535, "a slot's value"));
        range.set_to(whole_number((*four)[1], 0, 65535, "a slot's value"));
        for (const std::size_t i : {2u, 3u}) {
            const auto number = (*four)[i].value<double>();
            if (!number) refuse((*four)[i].source(), text_of((*four)[i]), kForm);
            i == 2 ? range.set_low(*number * property.unit) : range.set_high(*number * property.unit);
        }
    }
}

// One table of a patch, key by key.
void read_fixture(const toml::table& table, v1::SetPatch& patch) {
    only_keys(table,
              {"sacn", "artnet", "address", "target", "channels", "range", "ranges", "profiles", "gels", "merge"},
              "[[patch]]");
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
            if (find_property(key.str()) == nullptr) refuse(key.source(), std::string(key.str()), "is no property");
            range(value);
        }
    }
    const toml::table* parts = nullptr;
    if (const toml::node* node = table.get("ranges")) {
        parts = node->as_table();
        if (parts == nullptr)
            refuse(node->source(), text_of(*node), "ranges is a table: ranges.gobo = [[0, 9, 0, 0], [10, 19, 1, 1]]");
        for (const auto& [key, value] : *parts)
            if (find_property(key.str()) == nullptr) refuse(key.source(), std::string(key.str()), "is no property");
    }
    v1::PatchRow row;
    row.set_protocol(sacn != nullptr ? "sacn" : "artnet");
    row.set_universe(sacn != nullptr ? whole_number(*sacn, 1, 63999, "an sACN universe")
                                     : whole_number(*artnet, 0, 32767, "an Art-Net port-address"));
    std::uint32_t slot = whole_number(*address, 1, 512, "an address");
    const std::string name = target != nullptr ? word(*target, "target") : "";
    const toml::node* merge = table.get("merge");
    const std::string merged = merge != nullptr ? word(*merge, "merge") : "";
    const bool of_numbers = merged == "sum" || merged == "product";
    if (!merged.empty() && merged != "highest" && merged != "latest" && !of_numbers)
        refuse(merge->source(), merged, "merge is \"highest\", \"latest\", \"sum\" or \"product\"");
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
        if (merged == "latest" || of_numbers || property->htp) added.set_merge(merged);
        if (const toml::node* given = ranges != nullptr ? ranges->get(channel) : nullptr) {
            const Range written = range(*given);
            added.set_low(written.low * property->unit);
            added.set_high(written.high * property->unit);
        }
        if (const toml::node* given = parts != nullptr ? parts->get(channel) : nullptr)
            read_ranges(*given, *property, added);
        if (property->by_list) {
            const std::string key = channel + "s";  // profiles, gels
            const toml::node* list = table.get(key);
            if (list == nullptr || !list->is_array()) refuse(node.source(), channel, "needs " + key + " = [NAME, …]");
            for (const toml::node& one : *list->as_array()) added.add_profiles(word(one, "a name"));
        }
        if (patch.rows_size() > static_cast<int>(kMaxPatchRows))
            refuse({"too_large", "channels", std::to_string(patch.rows_size()), "a patch has at most 4,096 rows"});
        // Checked here, where the place in the file is still known.
        v1::SetPatch alone;
        *alone.add_rows() = added;
        if (const auto checked = check_patch(alone); !checked)
            refuse(node.source(), channel + (checked.error().value.empty() ? "" : " " + checked.error().value),
                   checked.error().message);
        slot += property->values * (bits / 8);
    }
}

}  // namespace

Result<v1::SetPatch> read_patch_toml(std::string_view text) {
    v1::SetPatch patch;
    const auto done = read({text, kMaxPatchFileBytes, "bad_patch", "a patch file"}, [&](const toml::table& file) {
        only_keys(file, {"patch"}, "a patch file");
        const toml::node* list = file.get("patch");
        if (list == nullptr) return;  // an empty file patches nothing
        if (!list->is_array_of_tables()) refuse(list->source(), "patch", "write [[patch]], one for each fixture");
        for (const toml::node& node : *list->as_array()) read_fixture(*node.as_table(), patch);
    });
    if (!done) return done.error();
    return patch;
}

std::string write_patch_toml(const v1::Patch& patch) {
    std::string text;
    for (const v1::PatchRow& row : patch.rows()) {
        const PropertyRow& property = *find_property(row.property());
        text += "[[patch]]\n" + row.protocol() + " = " + std::to_string(row.universe()) +
                "\naddress = " + std::to_string(row.address()) + "\n";
        if (!row.target().empty()) text += "target = " + quoted(row.target()) + "\n";
        text += "channels = [\"" + row.property() + (row.bits() == 16 ? ":16" : "") + "\"]\n";
        if (!row.merge().empty()) text += "merge = " + quoted(row.merge()) + "\n";
        if (row.has_low() || row.has_high())
            text += "range." + row.property() + " = [" +
                    number_text((row.has_low() ? row.low() : property.low) / property.unit) + ", " +
                    number_text((row.has_high() ? row.high() : property.high) / property.unit) + "]\n";
        if (row.ranges_size() > 0) {
            text += "ranges." + row.property() + " = [";
            for (int i = 0; i < row.ranges_size(); ++i) {
                const v1::PatchRange& one = row.ranges(i);
                text += (i > 0 ? ", [" : "[") + std::to_string(one.from()) + ", " + std::to_string(one.to()) + ", " +
                        number_text(one.low() / property.unit) + ", " + number_text(one.high() / property.unit) + "]";
            }
            text += "]\n";
        }
        if (row.profiles_size() > 0) {
            text += row.property() + "s = [";
            for (int i = 0; i < row.profiles_size(); ++i) text += (i > 0 ? ", " : "") + quoted(row.profiles(i));
            text += "]\n";
        }
        text += "\n";
    }
    return text;
}

}  // namespace gonio
