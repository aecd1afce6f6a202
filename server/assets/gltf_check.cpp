#include "server/assets/gltf_check.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "server/assets/assets.h"
#include "server/assets/gltf_expand.h"
#include "server/assets/gltf_features.h"
#include "server/assets/gltf_rules.h"

namespace gonio {
namespace {

using Json = nlohmann::json;

std::string shown(const Json& value) {
    std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
    if (text.size() > 80) text = text.substr(0, 77) + "...";
    return text;
}

Error bad(std::string where, const Json& value, std::string message) {
    return {"bad_gltf", std::move(where), shown(value), std::move(message)};
}

Error out_of_bounds(std::string where, std::string value, std::string message) {
    return {"out_of_bounds", std::move(where), std::move(value), std::move(message)};
}

// A member name as a JSON pointer spells it (RFC 6901).
std::string escaped(const std::string& name) {
    std::string result;
    for (const char c : name) result += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
    return result;
}

bool all_numbers(const Json& value) {
    return std::all_of(value.begin(), value.end(), [](const Json& item) { return item.is_number(); });
}

std::optional<Error> test(const Json& document, const Json& value, const std::string& where, const GltfRule& rule) {
    const auto expect = [&](bool good, const char* message) -> std::optional<Error> {
        if (good) return std::nullopt;
        return bad(where, value, message);
    };
    switch (rule.kind) {
        case RuleKind::array:
            return expect(value.is_array(), "an array is expected here");
        case RuleKind::object:
            return expect(value.is_object(), "an object is expected here");
        case RuleKind::objects:
            for (std::size_t i = 0; value.is_array() && i < value.size(); ++i) {
                if (!value[i].is_object())
                    return bad(where + "/" + std::to_string(i), value[i], "an object is expected here");
            }
            return expect(value.is_array(), "an array is expected here");
        case RuleKind::text:
            return expect(value.is_string(), "a string is expected here");
        case RuleKind::boolean:
            return expect(value.is_boolean(), "true or false is expected here");
        case RuleKind::number:
            return expect(value.is_number(), "a number is expected here");
        case RuleKind::numbers:
            if (value.is_array() && value.size() == rule.length && all_numbers(value)) return std::nullopt;
            return bad(where, value, "an array of " + std::to_string(rule.length) + " numbers is expected here");
        case RuleKind::size:
            if (value.is_number() && value.get<double>() > 2147483647.0)  // from 2^64 on JSON numbers are no integers
                return Error{"too_large", where, shown(value), "a size has at most 31 bits"};
            return expect(value.is_number_unsigned(), "a non-negative integer is expected here");
        case RuleKind::index: {
            if (!value.is_number_integer()) return bad(where, value, "an index is expected here");
            const auto target = Json::json_pointer(rule.target);
            const std::size_t count =
                document.contains(target) && document.at(target).is_array() ? document.at(target).size() : 0;
            if (value.is_number_unsigned() && value.get<std::uint64_t>() < count) return std::nullopt;
            return out_of_bounds(where, shown(value),
                                 std::string(rule.target) + " has " + std::to_string(count) + " elements");
        }
    }
    return std::nullopt;
}

// Tests what the rest of a pattern finds below `at`, whose own place is `where`.
std::optional<Error> visit(const Json& document, const Json& at, std::string_view pattern, const std::string& where,
                           const GltfRule& rule) {
    const std::size_t slash = pattern.find('/');
    const std::string_view head = pattern.substr(0, slash);
    const bool last = slash == std::string_view::npos;
    const auto descend = [&](const Json& child, const std::string& name) {
        const std::string place = where + "/" + name;
        return last ? test(document, child, place, rule)
                    : visit(document, child, pattern.substr(slash + 1), place, rule);
    };
    if (head == "*") {
        for (const auto& [key, child] : at.items()) {
            if (auto error = descend(child, escaped(key))) return error;
        }
        return std::nullopt;
    }
    if (!at.is_object()) return std::nullopt;  // refused by the parent's own rule
    const auto child = at.find(head);
    if (child != at.end()) return descend(*child, std::string(head));
    if (last && rule.required) return bad(where + "/" + std::string(head), at, "a required member is missing");
    return std::nullopt;
}

std::uint64_t size_of(const Json& object, const char* member) {
    return object.value(member, std::uint64_t{0});
}

std::string at(const char* array, std::size_t index, const char* member) {
    return std::string("/") + array + "/" + std::to_string(index) + "/" + member;
}

const Json& list(const Json& object, const char* name) {
    static const Json empty = Json::array();
    const auto found = object.find(name);
    return found == object.end() ? empty : *found;
}

// Every buffer view that anything names: accessors, sparse ones too, images, photometric files and Draco meshes.
void find_views_read(const Json& value, std::set<std::uint64_t>& read) {
    for (const auto& [name, child] : value.items()) {
        if (child.is_structured()) find_views_read(child, read);
        if (name == "bufferView" && child.is_number_unsigned()) read.insert(child.get<std::uint64_t>());
    }
}

std::optional<Error> check_buffers(const Json& document, bool has_binary_chunk) {
    std::uint64_t total = 0;
    const Json& buffers = list(document, "buffers");
    for (std::size_t i = 0; i < buffers.size(); ++i) {
        total += size_of(buffers[i], "byteLength");
        if (total > kMaxSceneFileBytes) {
            return Error{"too_large", at("buffers", i, "byteLength"), shown(buffers[i]["byteLength"]),
                         "the buffers together are larger than " + std::to_string(kMaxSceneFileBytes) + " bytes"};
        }
    }
    const Json& views = list(document, "bufferViews");
    std::set<std::uint64_t> read;
    find_views_read(document, read);
    for (std::size_t i = 0; i < views.size(); ++i) {
        const std::uint64_t end = size_of(views[i], "byteOffset") + size_of(views[i], "byteLength");
        const Json& buffer = buffers[views[i]["buffer"].get<std::size_t>()];
        const std::uint64_t held = size_of(buffer, "byteLength");
        if (is_meshopt_fallback(buffer) && !is_meshopt_view(views[i])) {
            return bad(at("bufferViews", i, "buffer"), views[i]["buffer"],
                       "only compressed views may lie in a fallback buffer");
        }
        // A buffer without bytes may stand for views that are compressed, or that nothing reads.
        const auto index = views[i]["buffer"].get<std::size_t>();
        const bool has_bytes = buffer.contains("uri") || (index == 0 && has_binary_chunk);
        if (!has_bytes && !is_meshopt_view(views[i]) && read.contains(i)) {
            return bad(at("buffers", index, "uri"), buffer, "a buffer has neither a uri nor a binary chunk");
        }
        if (end > held) {
            return out_of_bounds(
                at("bufferViews", i, "byteLength"), shown(views[i]["byteLength"]),
                "the buffer view ends at byte " + std::to_string(end) + " of a buffer of " + std::to_string(held));
        }
        const std::uint64_t stride = size_of(views[i], "byteStride");
        if (stride > 252 || stride % 4 != 0) {
            return bad(at("bufferViews", i, "byteStride"), views[i]["byteStride"],
                       "the stride must be a multiple of 4 up to 252 bytes");
        }
    }
    return std::nullopt;
}

// The last byte of `count` elements lies inside the view. Four numbers of an accessor, and where an error would be.
std::optional<Error> check_range(const Json& view, std::uint64_t offset, std::uint64_t count, std::uint64_t element,
                                 std::uint64_t stride, const std::string& where, const Json& value) {
    const std::uint64_t end = count == 0 ? offset : offset + (count - 1) * stride + element;
    const std::uint64_t held = size_of(view, "byteLength");
    if (end <= held) return std::nullopt;
    return out_of_bounds(
        where, shown(value),
        "the accessor ends at byte " + std::to_string(end) + " of a buffer view of " + std::to_string(held));
}

std::optional<Error> check_accessors(const Json& document) {
    const Json& accessors = list(document, "accessors");
    const Json& views = list(document, "bufferViews");
    for (std::size_t i = 0; i < accessors.size(); ++i) {
        const Json& accessor = accessors[i];
        const std::size_t bytes = component_bytes(size_of(accessor, "componentType"));
        const std::size_t components = component_count(accessor["type"].get<std::string>());
        if (bytes == 0) {
            return bad(at("accessors", i, "componentType"), accessor["componentType"],
                       "there is no such component type");
        }
        if (components == 0) return bad(at("accessors", i, "type"), accessor["type"], "there is no such accessor type");
        const std::uint64_t count = size_of(accessor, "count"), element = bytes * components;
        if (accessor.contains("bufferView")) {
            const Json& view = views[accessor["bufferView"].get<std::size_t>()];
            const std::uint64_t stride = size_of(view, "byteStride");  // 0 or absent: tightly packed
            if (auto error =
                    check_range(view, size_of(accessor, "byteOffset"), count, element, stride == 0 ? element : stride,
                                at("accessors", i, "count"), accessor["count"])) {
                return error;
            }
        }
        if (!accessor.contains("sparse")) continue;
        const Json& sparse = accessor["sparse"];
        const std::uint64_t changed = size_of(sparse, "count");
        if (changed > count) {
            return out_of_bounds(at("accessors", i, "sparse/count"), shown(sparse["count"]),
                                 "more sparse elements than the accessor has");
        }
        const std::uint64_t index_type = size_of(sparse["indices"], "componentType");
        if (index_type != 5121 && index_type != 5123 && index_type != 5125) {
            return bad(at("accessors", i, "sparse/indices/componentType"), sparse["indices"]["componentType"],
                       "indices are unsigned bytes, shorts or ints");
        }
        const std::size_t index_bytes = component_bytes(index_type);
        for (const auto& [member, size] : {std::pair<const char*, std::uint64_t>("indices", index_bytes),
                                           std::pair<const char*, std::uint64_t>("values", element)}) {
            const Json& view = views[sparse[member]["bufferView"].get<std::size_t>()];
            if (auto error = check_range(view, size_of(sparse[member], "byteOffset"), changed, size, size,
                                         at("accessors", i, "sparse/") + member, sparse["count"])) {
                return error;
            }
        }
    }
    return std::nullopt;
}

// A node has at most one parent, and no node is its own ancestor.
std::optional<Error> check_node_tree(const Json& document) {
    const Json& nodes = list(document, "nodes");
    constexpr std::size_t none = static_cast<std::size_t>(-1);
    std::vector<std::size_t> parent(nodes.size(), none);
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const Json& children = list(nodes[i], "children");
        for (std::size_t k = 0; k < children.size(); ++k) {
            const auto child = children[k].get<std::size_t>();
            if (parent[child] != none) {
                return bad(at("nodes", i, "children/") + std::to_string(k), children[k], "the node has two parents");
            }
            parent[child] = i;
        }
    }
    // Every node of a tree is reached from a node without parent; what is not reached lies on or under a cycle.
    std::vector<std::size_t> reached;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (parent[i] == none) reached.push_back(i);
    }
    std::vector<bool> seen(nodes.size());
    for (std::size_t next = 0; next < reached.size(); ++next) {
        seen[reached[next]] = true;
        for (const Json& child : list(nodes[reached[next]], "children")) reached.push_back(child.get<std::size_t>());
    }
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        if (!seen[i]) return bad(at("nodes", i, "children"), nodes[i].value("children", Json()), "a cycle of nodes");
    }
    return std::nullopt;
}

std::optional<Error> check_header(const Json& document) {
    if (!document.is_object()) return bad("", document, "a glTF file is one JSON object");
    const auto asset = document.find("asset");
    if (asset == document.end() || !asset->is_object() || !asset->contains("version")) {
        return bad("/asset/version", asset == document.end() ? Json() : *asset, "the glTF version is missing");
    }
    const Json& version = (*asset)["version"];
    if (!version.is_string()) return bad("/asset/version", version, "a string is expected here");
    if (version.get<std::string>().rfind("2.", 0) != 0) {
        return Error{"unsupported", "/asset/version", shown(version), "only glTF 2 is read"};
    }
    const Json least = asset->value("minVersion", Json("2.0"));
    if (!least.is_string()) return bad("/asset/minVersion", least, "a string is expected here");
    if (least.get<std::string>() != "2.0") {
        return Error{"unsupported", "/asset/minVersion", shown(least),
                     "the file needs a reader of a later glTF than 2.0"};
    }
    for (const char* name : {"extensionsRequired", "extensionsUsed"}) {
        const Json& extensions = list(document, name);
        if (!extensions.is_array()) return bad(std::string("/") + name, extensions, "an array is expected here");
        for (std::size_t i = 0; i < extensions.size(); ++i) {
            const std::string where = std::string("/") + name + "/" + std::to_string(i);
            if (!extensions[i].is_string()) return bad(where, extensions[i], "a string is expected here");
            const std::string extension = extensions[i].get<std::string>();
            const GltfFeature* const known = find_extension(extension);
            const bool read = known ? known->state != FeatureState::refused : is_of_materials(extension);
            if (name == std::string_view("extensionsRequired") && !read) {
                return Error{"unsupported", where, extension,
                             "the file requires an extension that Gonio does not read"};
            }
        }
    }
    return std::nullopt;
}

}  // namespace

std::size_t component_count(std::string_view type) {
    static constexpr std::array<std::pair<std::string_view, std::size_t>, 7> counts = {
        {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT2", 4}, {"MAT3", 9}, {"MAT4", 16}}};
    for (const auto& [name, count] : counts) {
        if (name == type) return count;
    }
    return 0;
}

std::size_t component_bytes(std::uint64_t component_type) {
    switch (component_type) {
        case 5120:  // signed and unsigned byte
        case 5121:
            return 1;
        case 5122:  // signed and unsigned short
        case 5123:
            return 2;
        case 5125:  // unsigned int, float
        case 5126:
            return 4;
        default:
            return 0;
    }
}

std::optional<Error> check_json_size(std::string_view text) {
    int depth = 0;
    std::size_t values = 0;
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (quoted) {
            if (c == '\\') ++i;
            quoted = c != '"';
            continue;
        }
        quoted = c == '"';
        if (c == '{' || c == '[') ++depth;
        if (c == '}' || c == ']') --depth;
        if (c == ',' || c == '{' || c == '[') ++values;
        if (depth <= kMaxJsonDepth && values <= kMaxJsonValues) continue;
        const std::string place = "byte " + std::to_string(i);
        if (depth > kMaxJsonDepth) return Error{"bad_gltf", place, "", "the JSON is nested too deeply"};
        return Error{"too_large", place, "", "the JSON has too many values"};
    }
    return std::nullopt;
}

std::optional<Error> check_gltf(const Json& document, bool has_binary_chunk) {
    if (auto error = check_header(document)) return error;
    for (const GltfRule& rule : kGltfRules) {
        if (auto error = visit(document, document, std::string_view(rule.pattern).substr(1), "", rule)) return error;
    }
    if (auto error = check_buffers(document, has_binary_chunk)) return error;
    if (auto error = check_accessors(document)) return error;
    return check_node_tree(document);
}

}  // namespace gonio
