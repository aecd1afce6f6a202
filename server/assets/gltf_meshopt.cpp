// EXT_meshopt_compression: buffer views get the bytes that they stand for.
#include <meshoptimizer.h>

#include <nlohmann/json.hpp>
#include <span>

#include "server/assets/assets.h"
#include "server/assets/gltf_check.h"
#include "server/assets/gltf_expand.h"
#include "server/assets/gltf_import.h"

namespace gonio {
namespace {

using Json = nlohmann::json;

constexpr const char* kMeshopt = "EXT_meshopt_compression";

// Whether the element size suits mode and filter (the extension's README, "Specifying compressed views").
bool suits(const std::string& mode, const std::string& filter, std::size_t count, std::size_t stride) {
    if (mode == "TRIANGLES") return (stride == 2 || stride == 4) && count % 3 == 0 && filter == "NONE";
    if (mode == "INDICES") return (stride == 2 || stride == 4) && filter == "NONE";
    if (stride == 0 || stride % 4 != 0 || stride > 256) return false;
    return filter == "NONE" || filter == "EXPONENTIAL" || (filter == "OCTAHEDRAL" && (stride == 4 || stride == 8)) ||
           (filter == "QUATERNION" && stride == 8);
}

}  // namespace

Result<std::vector<std::byte>> decode_meshopt(std::span<const std::byte> bytes, const std::string& mode,
                                              const std::string& filter, std::size_t count, std::size_t stride,
                                              const std::string& where) {
    if (mode != "ATTRIBUTES" && mode != "TRIANGLES" && mode != "INDICES")
        return Error{"bad_gltf", where + "/mode", mode, "there is no such mode"};
    if (!suits(mode, filter, count, stride))
        return Error{"bad_gltf", where + "/byteStride", std::to_string(stride),
                     "the stride, the count or the filter " + filter + " does not suit the mode " + mode};
    std::vector<std::byte> result(count * stride);
    const auto* const from = reinterpret_cast<const unsigned char*>(bytes.data());
    int failed = 0;
    if (mode == "ATTRIBUTES")
        failed = meshopt_decodeVertexBuffer(result.data(), count, stride, from, bytes.size());
    else if (mode == "TRIANGLES")
        failed = meshopt_decodeIndexBuffer(result.data(), count, stride, from, bytes.size());
    else
        failed = meshopt_decodeIndexSequence(result.data(), count, stride, from, bytes.size());
    if (failed != 0) return Error{"bad_gltf", where, mode, "the compressed buffer view is damaged"};
    if (filter == "OCTAHEDRAL") meshopt_decodeFilterOct(result.data(), count, stride);
    if (filter == "QUATERNION") meshopt_decodeFilterQuat(result.data(), count, stride);
    if (filter == "EXPONENTIAL") meshopt_decodeFilterExp(result.data(), count, stride);
    return result;
}

namespace {

std::optional<Error> expand(GltfExpansion& expansion, Json& view, const std::string& view_where) {
    const Json& compressed = view["extensions"][kMeshopt];
    const std::string where = view_where + "/extensions/" + kMeshopt;
    const auto number = [&](const char* member) { return compressed.value(member, std::size_t{0}); };
    const std::size_t count = number("count"), stride = number("byteStride");
    if (count * stride != view["byteLength"].get<std::size_t>() || view.value("byteStride", stride) != stride)
        return Error{"bad_gltf", where + "/count", std::to_string(count),
                     "count and byteStride are not those of the buffer view"};
    const auto& held = expansion.buffers[number("buffer")];
    if (number("byteOffset") + number("byteLength") > held.size())
        return Error{"out_of_bounds", where + "/byteLength", std::to_string(number("byteLength")),
                     "the compressed bytes end beyond a buffer of " + std::to_string(held.size())};
    if (auto full = take_expanded(expansion, count * stride, where + "/count")) return full;
    auto decoded =
        decode_meshopt(std::span(held).subspan(number("byteOffset"), number("byteLength")),
                       compressed["mode"].get<std::string>(), compressed.value("filter", "NONE"), count, stride, where);
    if (!decoded) return decoded.error();
    view["buffer"] = expansion.buffers.size();
    view["byteOffset"] = 0;
    expansion.buffers.push_back(std::move(*decoded));
    return std::nullopt;
}

}  // namespace

std::optional<Error> expand_meshopt(GltfExpansion& expansion) {
    if (!expansion.document.contains("bufferViews")) return std::nullopt;
    Json& views = expansion.document["bufferViews"];
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (!is_meshopt_view(views[i])) continue;
        if (auto error = expand(expansion, views[i], "/bufferViews/" + std::to_string(i))) return error;
    }
    return std::nullopt;
}

bool is_meshopt_view(const Json& view) {
    return view.contains("extensions") && view["extensions"].contains(kMeshopt);
}

bool is_meshopt_fallback(const Json& buffer) {
    return buffer.contains("extensions") && buffer["extensions"].contains(kMeshopt) &&
           buffer["extensions"][kMeshopt].value("fallback", false);
}

std::optional<Error> take_expanded(GltfExpansion& expansion, std::size_t bytes, const std::string& where) {
    if (bytes > kMaxExpandedBytes - expansion.expanded)
        return Error{"too_large", where, std::to_string(bytes),
                     "the compressed parts of the file hold more than " + std::to_string(kMaxExpandedBytes) + " bytes"};
    expansion.expanded += bytes;
    return take_memory(expansion.room, bytes, 1, where);
}

}  // namespace gonio
