#include "server/exchange/mvr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include "ies/core/text.h"
#include "server/exchange/axes.h"
#include "server/exchange/xml_read.h"
#include "server/scene/limits.h"

namespace gonio::mvr {
namespace {

using exchange::attribute_of;
using exchange::child_text;
using exchange::MatrixState;
using exchange::Outcome;

struct KindRow {
    std::string_view element;
    ObjectKind kind;
    const char* taken;  // of the report
};
constexpr auto kKinds = std::to_array<KindRow>({
    {"SceneObject", ObjectKind::scene_object, "scene object"},
    {"GroupObject", ObjectKind::group, "group"},
    {"FocusPoint", ObjectKind::focus_point, "focus point"},
    {"Fixture", ObjectKind::fixture, "fixture"},
    {"Support", ObjectKind::support, "support"},
    {"Truss", ObjectKind::truss, "truss"},
    {"VideoScreen", ObjectKind::video_screen, "video screen"},
    {"Projector", ObjectKind::projector, "projector"},
});

// Of objects: what is left out where it holds something.
constexpr auto kUnread = std::to_array<const char*>(
    {"Alignments", "Overwrites", "Connections", "Mappings", "Protocols", "Sources", "Projections"});

auto row_of(const pugi::xml_node& node) {
    return std::find_if(kKinds.begin(), kKinds.end(), [&](const KindRow& one) { return one.element == node.name(); });
}

using Table = std::map<std::string, int, std::less<>>;

// A Geometry3D or a Symbol, read once however often it is shown.
struct Symdef;
struct Part {
    std::string_view file;      // of a Geometry3D, as written
    EntryIndex::Found found{};  // its file
    bool is_symbol = false;
    std::string uuid{};            // of a Symbol's Symdef
    Symdef* symdef = nullptr;      // null: it is not defined
    pugi::xml_node matrix_node{};  // or null
    exchange::ReadMatrix matrix{};
};
struct Symdef {
    pugi::xml_node node;
    std::string_view name;
    std::optional<std::vector<Part>> parts{};  // none: not read yet
};

struct Reading {
    const EntryIndex& entries;
    const ReadOptions& options;
    Show& show;
    std::map<std::string, Symdef, std::less<>> symdefs{};
    Table classes{}, positions{}, focus{};                         // by UUID
    std::set<std::string, std::less<>> uuids{};                    // of objects
    std::vector<std::pair<std::size_t, std::string>> aimed{};      // fixture and the UUID of its focus point
    std::map<std::string, std::size_t, std::less<>> fixtures{};    // by UUID
    std::vector<std::pair<std::size_t, std::string>> followers{};  // fixture and the UUID of that whose patch it has
    std::size_t count = 0, parts = 0;   // of objects, parts of symbols at each place; of parts that were read
    std::vector<const Symdef*> open{};  // being expanded

    void note(Outcome outcome, std::string what, std::string_view name) {
        show.report.add(outcome, std::move(what), name);
    }
    std::optional<Error> counted(std::size_t& of, std::string_view name) {
        if (++of <= kMaxObjects) return std::nullopt;
        return Error{"too_large", "Layers", shown_text(name),
                     "a show has at most " + std::to_string(kMaxObjects) + " objects and models"};
    }
};

using exchange::written;

// node: the Matrix, or null.
glm::dmat4 noted_matrix(Reading& reading, const exchange::ReadMatrix& read, const pugi::xml_node& node,
                        std::string_view name) {
    if (read.state == MatrixState::empty && node)
        reading.note(Outcome::defaulted, "an empty matrix: it is where its parent is", name);
    if (read.state == MatrixState::bad)
        reading.note(Outcome::defaulted, "a matrix is not of numbers up to 1,000 km: it is where its parent is",
                     written(name, "Matrix", node.text().get()));
    if (read.state == MatrixState::singular)
        reading.note(Outcome::guessed, "a matrix's axes span no space: only its position was taken", name);
    return read.matrix;
}

glm::dmat4 matrix_of(Reading& reading, const pugi::xml_node& node, std::string_view name) {
    return noted_matrix(reading, exchange::mvr_matrix(child_text(node, "Matrix")), node.child("Matrix"), name);
}

void add_list(const pugi::xml_node& scene, const char* element, std::vector<Named>& list, Table* table) {
    for (const pugi::xml_node node : scene.children(element)) {
        if (table != nullptr) table->emplace(plain_uuid(attribute_of(node, "uuid")), static_cast<int>(list.size()));
        list.push_back({plain_uuid(attribute_of(node, "uuid")), std::string(attribute_of(node, "name"))});
    }
}

// Notes the elements below `node` that are not read: all but those of `read`, and any of those but its first.
// of: what the node is. name: its own.
void note_unread(Reading& reading, const pugi::xml_node& node, std::span<const std::string_view> read,
                 const std::string& of, std::string_view name) {
    std::set<std::string_view> seen;
    for (const pugi::xml_node child : node.children()) {
        if (child.type() != pugi::node_element) continue;
        const std::string_view element = child.name();
        const bool known = std::find(read.begin(), read.end(), element) != read.end();
        if (known && seen.insert(element).second) continue;
        const std::string_view own = attribute_of(child, "name");
        reading.note(Outcome::left_out, (known ? "a further " : "") + shown_text(element) + " of " + of,
                     own.empty() ? name : own);
    }
}

// Adds the Geometry3D and Symbol elements below `node`, a list of `of`. name: of the object that shows them.
std::optional<Error> read_parts(Reading& reading, const pugi::xml_node& node, const char* of, std::string_view name,
                                std::vector<Part>& parts) {
    const pugi::xml_node list = node.child("ChildList");  // of a symbol
    for (const pugi::xml_node child : node.children()) {
        const std::string_view element = child.name();
        if (element != "Geometry3D" && element != "Symbol") {
            if (child.type() == pugi::node_element && child != list)
                reading.note(Outcome::left_out, shown_text(element) + " of " + of, name);
            continue;
        }
        if (auto error = reading.counted(reading.parts, name)) return error;
        Part part;
        part.matrix_node = child.child("Matrix");
        part.matrix = exchange::mvr_matrix(child_text(child, "Matrix"));
        if (element == "Geometry3D") {
            part.file = attribute_of(child, "fileName");
            part.found = reading.entries.find(part.file, part.file.find('.') == std::string_view::npos ? ".3ds" : "");
        } else {
            part.is_symbol = true;
            part.uuid = plain_uuid(attribute_of(child, "symdef"));
            if (const auto at = reading.symdefs.find(part.uuid); at != reading.symdefs.end()) part.symdef = &at->second;
        }
        parts.push_back(std::move(part));
    }
    return std::nullopt;
}

// world: of the object or symbol, Z up, mm.
std::optional<Error> add_models(Reading& reading, const std::vector<Part>& parts, int object, const glm::dmat4& world,
                                int depth) {
    const std::string& name = reading.show.objects[static_cast<std::size_t>(object)].name;
    for (const Part& part : parts) {
        if (auto error = reading.counted(reading.count, name)) return error;
        if (!part.is_symbol) {
            if (part.found.entry.empty()) {
                reading.note(Outcome::left_out, "a model's file is not in the archive",
                             part.file.empty() ? std::string_view(name) : part.file);
                continue;
            }
            if (!part.found.as_written)
                reading.note(Outcome::guessed, "a model's file was found by another name", part.file);
            const glm::dmat4 here = world * noted_matrix(reading, part.matrix, part.matrix_node, part.file);
            reading.show.models.push_back({object, part.found.entry, exchange::scene_matrix(here)});
        } else if (part.symdef == nullptr) {
            reading.note(Outcome::left_out, "a symbol is not defined", part.uuid.empty() ? name : part.uuid);
        } else if (std::find(reading.open.begin(), reading.open.end(), part.symdef) != reading.open.end()) {
            reading.note(Outcome::left_out, "a symbol contains itself", part.symdef->name);
        } else if (depth >= kMaxDepth) {
            reading.note(Outcome::left_out, "a symbol lies too deep", part.symdef->name);
        } else {
            Symdef& symdef = *part.symdef;
            if (!symdef.parts) {
                symdef.parts.emplace();
                // Its list stands in a ChildList, or without one.
                for (const pugi::xml_node list : {symdef.node, symdef.node.child("ChildList")})
                    if (auto error = read_parts(reading, list, "a symbol", symdef.name, *symdef.parts)) return error;
            }
            const glm::dmat4 here = world * noted_matrix(reading, part.matrix, part.matrix_node, name);
            reading.open.push_back(&symdef);
            if (auto error = add_models(reading, *symdef.parts, object, here, depth + 1)) return error;
            reading.open.pop_back();
        }
    }
    return std::nullopt;
}

// Result: the whole number that the text is; nothing where it is empty, or none, which is noted.
std::optional<long long> noted_number(Reading& reading, std::string_view text, const char* element,
                                      std::string_view name) {
    const auto number = exchange::whole_number_of(text);
    if (!number && !text.empty())
        reading.note(Outcome::defaulted, "a value is no number: its default stands", written(name, element, text));
    return number;
}

void add_patches(Reading& reading, const pugi::xml_node& node, std::string_view name, Fixture& fixture) {
    struct Written {
        long long dmx_break;
        std::string_view text;
    };
    std::vector<Written> written;
    bool from_zero = false;
    for (const pugi::xml_node address : node.child("Addresses").children("Address")) {
        // Far ones stay too far, so that one more cannot overflow.
        const long long dmx_break =
            std::clamp(noted_number(reading, attribute_of(address, "break"), "break", name).value_or(0), -1ll, 1'000ll);
        from_zero = from_zero || dmx_break == 0;
        if (written.size() < 512) written.push_back({dmx_break, exchange::trimmed(address.text().get())});
    }
    // MVR's breaks count from 0, GDTF's from 1; a fixture without a break 0 has taken over GDTF's.
    if (!from_zero && !written.empty()) reading.note(Outcome::guessed, "a fixture's breaks count from 1", name);
    for (const Written& one : written) {
        const auto address = address_of(one.text);
        if (!address) {
            if (exchange::whole_number_of(one.text).value_or(-1) != 0 && one.text != "0.0")
                reading.note(Outcome::left_out, "an address is none", std::string(name) + ": " + std::string(one.text));
            continue;
        }
        const long long universe = static_cast<long long>(address->universe) + reading.options.universe_offset;
        const long long dmx_break = one.dmx_break + (from_zero ? 1 : 0);
        if (universe < 1 || universe > kMostUniverse || dmx_break < 1 || dmx_break > 512) {
            reading.note(Outcome::left_out, "an address lies beyond what there is", name);
            continue;
        }
        fixture.patches.push_back({static_cast<int>(dmx_break), static_cast<unsigned>(universe), address->address});
    }
}

// Whether a label is no gel: CIE D65, rounded as exporters do.
bool is_white(const std::array<double, 3>& color) {
    return std::abs(color[0] - 0.3127) < 2e-3 && std::abs(color[1] - 0.3290) < 2e-3;
}

bool is_true(std::string_view text) {
    return text == "true" || text == "True" || text == "1";
}

void add_fixture(Reading& reading, const pugi::xml_node& node, int object, std::string_view name) {
    Fixture fixture;
    fixture.object = object;
    fixture.spec = std::string(child_text(node, "GDTFSpec"));
    if (fixture.spec.empty()) {
        reading.note(Outcome::left_out, "a fixture names no GDTF file", name);
    } else if (const auto found = reading.entries.find(fixture.spec, ".gdtf"); found.entry.empty()) {
        reading.note(Outcome::left_out, "a fixture's GDTF file is not in the archive", fixture.spec);
    } else {
        fixture.entry = found.entry;
        if (!found.as_written) reading.note(Outcome::guessed, "a GDTF file was found by another name", fixture.spec);
    }
    fixture.mode = std::string(child_text(node, "GDTFMode"));
    fixture.fixture_id = std::string(child_text(node, "FixtureID"));
    fixture.custom_id = std::string(child_text(node, "CustomId"));
    fixture.unit_number = std::string(child_text(node, "UnitNumber"));
    fixture.fixture_id_numeric = noted_number(reading, child_text(node, "FixtureIDNumeric"), "FixtureIDNumeric", name);
    if (const auto at = reading.positions.find(plain_uuid(child_text(node, "Position"))); at != reading.positions.end())
        fixture.position = reading.show.positions[static_cast<std::size_t>(at->second)].name;
    if (const std::string_view focus = child_text(node, "Focus"); !focus.empty())
        reading.aimed.emplace_back(reading.show.fixtures.size(), plain_uuid(focus));
    fixture.invert_pan = is_true(child_text(node, "DMXInvertPan"));
    fixture.invert_tilt = is_true(child_text(node, "DMXInvertTilt"));
    fixture.casts_shadow = !node.child("CastShadow") || is_true(child_text(node, "CastShadow"));
    if (const std::string_view picture = child_text(node, "Gobo"); !picture.empty()) {
        fixture.gobo = reading.entries.find(picture, ".png").entry;
        if (fixture.gobo.empty())
            reading.note(Outcome::left_out, "a fixture's gobo is not in the archive", written(name, "Gobo", picture));
        const std::string_view turn = attribute_of(node.child("Gobo"), "rotation");
        const auto turn_deg = exchange::number_of(turn);
        if (turn_deg && std::isfinite(*turn_deg))
            fixture.gobo_rad = std::remainder(*turn_deg, 360.0) * (std::numbers::pi / 180.0);
        else if (!turn.empty())
            reading.note(Outcome::defaulted, "a value is no number: its default stands",
                         written(name, "rotation", turn));
    }
    const std::string_view label = child_text(node, "Color");
    if (const auto color = exchange::bracketed_numbers(label); color && color->size() == 3)
        fixture.color = {(*color)[0], (*color)[1], (*color)[2]};
    else if (!label.empty())
        reading.note(Outcome::left_out, "a fixture's colour is none", written(name, "Color", label));
    if (fixture.color && !is_white(*fixture.color))
        reading.note(Outcome::left_out, "Color of a fixture: it lights without a gel", name);
    for (const pugi::xml_node command : node.child("CustomCommands").children("CustomCommand"))
        if (fixture.commands.size() < 256) fixture.commands.emplace_back(exchange::trimmed(command.text().get()));
    add_patches(reading, node, name, fixture);
    reading.fixtures.emplace(plain_uuid(attribute_of(node, "uuid")), reading.show.fixtures.size());
    if (const std::string_view leader = attribute_of(node, "multipatch"); !leader.empty())
        reading.followers.emplace_back(reading.show.fixtures.size(), plain_uuid(leader));
    reading.show.fixtures.push_back(std::move(fixture));
}

std::optional<Error> add_objects(Reading& reading, const pugi::xml_node& list, int layer, int parent,
                                 const glm::dmat4& world, int depth) {
    for (const pugi::xml_node node : list.children()) {
        const auto row = row_of(node);
        const std::string name(attribute_of(node, "name"));
        if (row == kKinds.end()) {
            if (node.type() == pugi::node_element)
                reading.note(Outcome::left_out, "there is no such object", node.name());
            continue;
        }
        if (depth >= kMaxDepth) {
            reading.note(Outcome::left_out, "an object lies too deep", name);
            continue;
        }
        if (auto error = reading.counted(reading.count, name)) return error;
        const int here = static_cast<int>(reading.show.objects.size());
        const glm::dmat4 own = world * matrix_of(reading, node, name);
        Object object{row->kind, name, plain_uuid(attribute_of(node, "uuid")), layer, parent};
        object.world_from_object = exchange::scene_matrix(own);
        if (const auto at = reading.classes.find(plain_uuid(child_text(node, "Classing"))); at != reading.classes.end())
            object.object_class = at->second;
        if (!object.uuid.empty() && !reading.uuids.insert(object.uuid).second)
            reading.note(Outcome::guessed, "two objects have one UUID: what refers to it means the first", name);
        reading.note(Outcome::taken, row->taken, name);
        const std::string uuid = object.uuid;
        reading.show.objects.push_back(std::move(object));
        if (row->kind == ObjectKind::fixture) {
            add_fixture(reading, node, here, name);
        } else if (!child_text(node, "GDTFSpec").empty()) {
            reading.note(Outcome::left_out, "the GDTF file of an object that is no fixture", name);
        }
        if (row->kind == ObjectKind::focus_point) {
            if (node.child("Geometries").first_child())
                reading.note(Outcome::left_out, "Geometries of a focus point", name);
            reading.focus.emplace(uuid, static_cast<int>(reading.show.focus_points.size()));
            reading.show.focus_points.push_back(
                {here, glm::dvec3(reading.show.objects[static_cast<std::size_t>(here)].world_from_object[3])});
        } else {
            std::vector<Part> parts;
            if (auto error = read_parts(reading, node.child("Geometries"), "an object's Geometries", name, parts))
                return error;
            if (auto error = add_models(reading, parts, here, own, 0)) return error;
        }
        for (const char* element : kUnread)
            if (const pugi::xml_node unread = node.child(element); unread && unread.first_child())
                reading.note(Outcome::left_out, std::string(element) + " of an object", name);
        const pugi::xml_node children = node.child("ChildList"), geometries = node.child("Geometries");
        for (const pugi::xml_node child : node.children()) {
            const std::string_view element = child.name();
            if (row_of(child) != kKinds.end())
                reading.note(Outcome::left_out, std::string(element) + " of an object, outside of its ChildList",
                             attribute_of(child, "name"));
            else if ((element == "ChildList" && child != children) || (element == "Geometries" && child != geometries))
                reading.note(Outcome::left_out, "a further " + std::string(element) + " of an object", name);
        }
        if (auto error = add_objects(reading, children, layer, here, own, depth + 1)) return error;
    }
    return std::nullopt;
}

std::optional<Error> add_layers(Reading& reading, const pugi::xml_node& scene) {
    static constexpr std::array<std::string_view, 2> kOfScene{"AUXData", "Layers"}, kOfLayer{"Matrix", "ChildList"};
    note_unread(reading, scene, kOfScene, "a scene", "");
    for (const pugi::xml_node node : scene.child("Layers").children("Layer")) {
        note_unread(reading, node, kOfLayer, "a layer", attribute_of(node, "name"));
        const std::string name(attribute_of(node, "name"));
        const glm::dmat4 world = matrix_of(reading, node, name);
        glm::dmat4 lift(1.0);
        lift[3].z = world[3].z;
        if (world != lift) reading.note(Outcome::guessed, "a layer's matrix does more than lift it", name);
        const int layer = static_cast<int>(reading.show.layers.size());
        reading.show.layers.push_back({plain_uuid(attribute_of(node, "uuid")), name});
        reading.note(Outcome::taken, "layer", name);
        if (auto error = add_objects(reading, node.child("ChildList"), layer, -1, world, 0)) return error;
    }
    return std::nullopt;
}

// Fixtures without addresses have those of the fixture that they name, which may name another.
void add_followed_patches(Reading& reading) {
    std::vector<Fixture>& fixtures = reading.show.fixtures;
    std::map<std::size_t, std::size_t> leaders;
    for (const auto& [fixture, uuid] : reading.followers)
        if (const auto at = reading.fixtures.find(uuid); at != reading.fixtures.end())
            leaders.emplace(fixture, at->second);
    std::set<std::size_t> seen;  // each fixture is walked once: from there on its patch is known
    for (const auto& [first, leader] : leaders) {
        std::vector<std::size_t> chain;
        std::size_t at = first;
        while (fixtures[at].patches.empty() && leaders.contains(at) && seen.insert(at).second) {
            chain.push_back(at);
            at = leaders.at(at);
        }
        if (std::find(chain.begin(), chain.end(), at) != chain.end())
            reading.note(Outcome::left_out, "a multipatch leads back to itself",
                         reading.show.objects[static_cast<std::size_t>(fixtures[at].object)].name);
        for (const std::size_t follower : chain)
            if (follower != at) fixtures[follower].patches = fixtures[at].patches;
    }
}

// The user data of Gonio. What is out of range says nothing.
void add_states(Reading& reading, const pugi::xml_node& user_data) {
    for (const pugi::xml_node data : user_data.children("Data")) {
        if (attribute_of(data, "provider") != kProvider) continue;
        for (const pugi::xml_node node : data.children("Light")) {
            const auto level = exchange::number_of(node, "level"), multiplier = exchange::number_of(node, "multiplier");
            const auto red = exchange::number_of(node, "red"), green = exchange::number_of(node, "green"),
                       blue = exchange::number_of(node, "blue");
            const auto within = [](const std::optional<double>& value, double most) {
                return value && *value >= 0.0 && *value <= most;
            };
            const std::string uuid = plain_uuid(attribute_of(node, "uuid"));
            const auto at = reading.fixtures.find(uuid);
            if (at == reading.fixtures.end() || !within(level, 1.0) || !within(multiplier, kMostMultiplier) ||
                !within(red, 1.0) || !within(green, 1.0) || !within(blue, 1.0)) {
                reading.note(Outcome::left_out, "user data of a light", uuid);
                continue;
            }
            reading.show.fixtures[at->second].state = FixtureState{*level, *multiplier, {*red, *green, *blue}};
        }
    }
}

}  // namespace

Result<Show> read_show(std::string_view xml, std::span<const std::string> names, const ReadOptions& options) {
    pugi::xml_document document;
    if (auto read = exchange::read_xml(xml, "bad_mvr", document); !read) return read.error();
    const pugi::xml_node root = document.child("GeneralSceneDescription");
    const pugi::xml_node scene = root.child("Scene");
    if (!scene)
        return Error{"bad_mvr", "GeneralSceneDescription", shown_text(document.first_child().name()),
                     "there is no scene"};
    Show show;
    show.version = std::string(attribute_of(root, "verMajor")) + "." + std::string(attribute_of(root, "verMinor"));
    show.provider = std::string(attribute_of(root, "provider"));
    if (show.provider.empty()) show.provider = attribute_of(root.child("UserData").child("Data"), "provider");
    const EntryIndex entries(names);
    Reading reading{entries, options, show};
    const pugi::xml_node aux = scene.child("AUXData");
    add_list(aux, "Class", show.classes, &reading.classes);
    add_list(aux, "Position", show.positions, &reading.positions);
    add_list(aux, "Symdef", show.symbols, nullptr);
    for (const pugi::xml_node node : aux.children("Symdef"))
        reading.symdefs.emplace(plain_uuid(attribute_of(node, "uuid")), Symdef{node, attribute_of(node, "name")});
    if (auto error = add_layers(reading, scene)) return *error;
    for (const auto& [fixture, uuid] : reading.aimed) {
        const auto at = reading.focus.find(uuid);
        if (at == reading.focus.end())
            reading.note(Outcome::left_out, "a fixture's focus point does not exist",
                         show.objects[static_cast<std::size_t>(show.fixtures[fixture].object)].name);
        else
            show.fixtures[fixture].focus = at->second;
    }
    add_states(reading, root.child("UserData"));
    add_followed_patches(reading);
    for (const Fixture& fixture : show.fixtures)
        if (fixture.patches.empty())
            reading.note(Outcome::left_out, "a fixture is not patched",
                         show.objects[static_cast<std::size_t>(fixture.object)].name);
    return show;
}

Result<Show> read_mvr(const ZipArchive& archive, const ReadOptions& options) {
    std::vector<std::string> entries;
    std::string description = "GeneralSceneDescription.xml";
    for (const ZipEntry& entry : archive.entries())
        if (!entry.is_folder()) entries.push_back(entry.name);
    if (archive.find(description) == nullptr) {
        const auto found = EntryIndex(entries).find(description, ".xml");
        if (!found.entry.empty()) {
            description = found.entry;
        } else if (const auto type = EntryIndex(entries).find("description.xml", ".xml"); !type.entry.empty()) {
            return Error{"bad_mvr", type.entry, "",
                         "the file is a GDTF fixture, no show; load an MVR show that holds the fixture, or add a light "
                         "with a photometric file of it"};
        }
    }
    const auto xml = archive.read(description);
    if (!xml) return xml.error();
    return read_show(*xml, entries, options);
}

}  // namespace gonio::mvr
