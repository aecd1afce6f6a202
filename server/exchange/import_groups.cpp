// What an MVR show says of its lights beside light: which fixture each is of, and the groups that they are in.
#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

#include "server/exchange/import_parts.h"
#include "server/scene/limits.h"

namespace gonio::exchange {
namespace {

// "2.101 + 5.1", of its breaks.
std::string addresses_of(const mvr::Fixture& fixture) {
    constexpr std::size_t kMost = 8;
    std::string text;
    for (std::size_t i = 0; i < fixture.patches.size() && i < kMost; ++i)
        text += (text.empty() ? "" : " + ") + std::to_string(fixture.patches[i].universe) + "." +
                std::to_string(fixture.patches[i].address);
    return text + (fixture.patches.size() > kMost ? " + …" : "");
}

struct Gathered {
    std::string name;
    const char* kind;
    std::vector<std::uint32_t> lights;
};

// By identity, in the order of their first lights.
class Gathering {
public:
    void add(const char* kind, int index, const std::string& name, std::uint32_t light) {
        if (name.empty()) return;
        const auto [at, fresh] = places_.try_emplace({kind, index, index < 0 ? name : ""}, groups_.size());
        if (fresh) groups_.push_back({shortened_text(name, kMaxNameBytes), kind, {}});
        std::vector<std::uint32_t>& lights = groups_[at->second].lights;
        if (lights.empty() || lights.back() != light) lights.push_back(light);
    }
    std::vector<Gathered>& groups() { return groups_; }

private:
    std::map<std::tuple<std::string_view, int, std::string>, std::size_t> places_;
    std::vector<Gathered> groups_;
};

Gathering gathered(const ShowImport& import) {
    const mvr::Show& show = import.show;
    Gathering gathering;
    const auto object_of = [&](std::size_t light) -> const mvr::Object& {
        return show.objects[static_cast<std::size_t>(import.fixture_of[light]->object)];
    };
    const auto each = [&](const auto& add) {
        for (std::size_t i = 0; i < import.fixture_of.size(); ++i) add(static_cast<std::uint32_t>(i), object_of(i));
    };
    // The nearest first: what a person would call a group, then what the show is made of.
    each([&](std::uint32_t light, const mvr::Object& object) {
        for (int at = object.parent; at >= 0; at = show.objects[static_cast<std::size_t>(at)].parent)
            if (const mvr::Object& parent = show.objects[static_cast<std::size_t>(at)];
                parent.kind == mvr::ObjectKind::group)
                gathering.add("group", at, parent.name, light);
    });
    each([&](std::uint32_t light, const mvr::Object& object) {
        if (object.layer >= 0)
            gathering.add("layer", object.layer, show.layers[static_cast<std::size_t>(object.layer)].name, light);
    });
    each([&](std::uint32_t light, const mvr::Object& object) {
        if (object.object_class >= 0)
            gathering.add("class", object.object_class,
                          show.classes[static_cast<std::size_t>(object.object_class)].name, light);
    });
    each([&](std::uint32_t light, const mvr::Object&) {
        gathering.add("position", -1, import.fixture_of[light]->position, light);
    });
    return gathering;
}

}  // namespace

void note_imported(ShowImport& import, const mvr::Fixture& fixture, const std::string& beam) {
    const mvr::Object& object = import.show.objects[static_cast<std::size_t>(fixture.object)];
    ImportedLight light;
    light.uuid = shortened_text(object.uuid, kMaxNameBytes);
    light.beam = shortened_text(beam, kMaxNameBytes);
    light.number = fixture.fixture_id_numeric ? std::to_string(*fixture.fixture_id_numeric)
                                              : shortened_text(fixture.fixture_id, kMaxNameBytes);
    light.type = shortened_text(fixture.spec, kMaxNameBytes);
    light.mode = shortened_text(fixture.mode, kMaxNameBytes);
    light.addresses = addresses_of(fixture);
    import.imported.lights.push_back(std::move(light));
    import.fixture_of.push_back(&fixture);
}

void import_groups(ShowImport& import) {
    if (import.show.provider == mvr::kProvider) return;  // its layers are not those of a person
    std::vector<ImportedGroup>& groups = import.imported.groups;
    const auto of_name = [&](const std::string& name) { return std::ranges::find(groups, name, &ImportedGroup::name); };
    const auto is_free = [&](const std::string& name) {
        return of_name(name) == groups.end() && !import.light_names.contains(name);
    };
    Gathering gathering = gathered(import);
    for (Gathered& group : gathering.groups()) {
        if (const auto same = of_name(group.name); same != groups.end() && same->lights == group.lights) continue;
        std::string name = group.name;
        for (int number = 1; !is_free(name); ++number) {
            const std::string suffix =
                " (" + std::string(group.kind) + (number > 1 ? " " + std::to_string(number) : "") + ")";
            name = shortened_text(group.name, kMaxNameBytes - suffix.size()) + suffix;
        }
        if (groups.size() >= kMostShowGroups) {
            import.report.add(Outcome::left_out,
                              "a group beyond the " + std::to_string(kMostShowGroups) + " that are taken of a show",
                              name);
            continue;
        }
        groups.push_back({std::move(name), std::move(group.lights)});
    }
}

}  // namespace gonio::exchange
