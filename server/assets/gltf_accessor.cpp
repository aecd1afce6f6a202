// Accessors of a checked glTF document -> numbers.
#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "server/assets/gltf_check.h"
#include "server/assets/gltf_document.h"

namespace gonio {
namespace {

const tinygltf::Accessor& accessor_at(const GltfDocument& document, int accessor) {
    return document.model->accessors[accessor];
}

std::string place(int accessor) {
    return "/accessors/" + std::to_string(accessor);
}

// glTF is little-endian, as are the machines that Gonio runs on.
template <typename T>
T load(const std::byte* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
}

std::uint32_t load_unsigned(const std::byte* at, int component_type) {
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return load<std::uint8_t>(at);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return load<std::uint16_t>(at);
        default:
            return load<std::uint32_t>(at);
    }
}

// glTF 2.0, 3.11 "Accessor Data Types": f = max(c / 127, -1), c / 255 and so on.
float load_float(const std::byte* at, int component_type, bool normalised) {
    const auto scaled = [&](double value, double most) {
        return static_cast<float>(normalised ? std::max(value / most, -1.0) : value);
    };
    switch (component_type) {
        case TINYGLTF_COMPONENT_TYPE_BYTE:
            return scaled(load<std::int8_t>(at), 127.0);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
            return scaled(load<std::uint8_t>(at), 255.0);
        case TINYGLTF_COMPONENT_TYPE_SHORT:
            return scaled(load<std::int16_t>(at), 32767.0);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
            return scaled(load<std::uint16_t>(at), 65535.0);
        case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
            return scaled(load<std::uint32_t>(at), 4294967295.0);
        default:
            return load<float>(at);
    }
}

// Which elements a sparse accessor replaces. Errors: "out_of_bounds".
Result<std::vector<std::uint32_t>> sparse_targets(const GltfDocument& document, int index) {
    const tinygltf::Accessor& accessor = accessor_at(document, index);
    std::vector<std::uint32_t> targets;
    const int type = accessor.sparse.indices.componentType;
    const std::size_t bytes = component_bytes(type);
    const ByteView view = view_bytes(document, accessor.sparse.indices.bufferView);
    for (int i = 0; i < accessor.sparse.count; ++i) {
        const std::uint32_t target = load_unsigned(view.data() + accessor.sparse.indices.byteOffset + i * bytes, type);
        if (target >= accessor.count) {
            return Error{"out_of_bounds", place(index) + "/sparse/indices", std::to_string(target),
                         "a sparse index beyond the accessor's " + std::to_string(accessor.count) + " elements"};
        }
        targets.push_back(target);
    }
    return targets;
}

// Calls take(element, bytes of the element) for every stored element, then for every sparse substitution.
template <typename Take>
Result<bool> for_each_element(const GltfDocument& document, int index, Take take) {
    const tinygltf::Accessor& accessor = accessor_at(document, index);
    const std::size_t element = component_bytes(accessor.componentType) * accessor_components(document, index);
    if (accessor.bufferView >= 0) {
        const auto& view = document.model->bufferViews[accessor.bufferView];
        const std::size_t stride = view.byteStride == 0 ? element : view.byteStride;
        const ByteView bytes = view_bytes(document, accessor.bufferView);
        for (std::size_t i = 0; i < accessor.count; ++i) take(i, bytes.data() + accessor.byteOffset + i * stride);
    }
    if (!accessor.sparse.isSparse) return true;
    const auto targets = sparse_targets(document, index);
    if (!targets) return targets.error();
    const ByteView values = view_bytes(document, accessor.sparse.values.bufferView);
    for (std::size_t i = 0; i < targets->size(); ++i) {
        take((*targets)[i], values.data() + accessor.sparse.values.byteOffset + i * element);
    }
    return true;
}

}  // namespace

std::size_t accessor_count(const GltfDocument& document, int accessor) {
    return accessor_at(document, accessor).count;
}

std::size_t accessor_components(const GltfDocument& document, int accessor) {
    return tinygltf::GetNumComponentsInType(accessor_at(document, accessor).type);
}

Result<std::vector<float>> read_any_floats(const GltfDocument& document, int index) {
    const tinygltf::Accessor& accessor = accessor_at(document, index);
    const std::size_t components = accessor_components(document, index);
    const std::size_t bytes = component_bytes(accessor.componentType);
    std::vector<float> values(accessor.count * components, 0.0f);
    const auto done = for_each_element(document, index, [&](std::size_t element, const std::byte* at) {
        for (std::size_t c = 0; c < components; ++c) {
            values[element * components + c] = load_float(at + c * bytes, accessor.componentType, accessor.normalized);
        }
    });
    if (!done) return done.error();
    return values;
}

Result<std::vector<float>> read_floats(const GltfDocument& document, int index) {
    auto values = read_any_floats(document, index);
    if (!values) return values;
    const auto odd = std::find_if(values->begin(), values->end(), [](float value) { return !std::isfinite(value); });
    if (odd != values->end()) {
        const auto element = static_cast<std::size_t>(odd - values->begin()) / accessor_components(document, index);
        return Error{"bad_gltf", place(index), std::isnan(*odd) ? "NaN" : "infinity",
                     "element " + std::to_string(element) + " of the accessor is not finite"};
    }
    return values;
}

Result<std::vector<std::uint32_t>> read_indices(const GltfDocument& document, int index) {
    const tinygltf::Accessor& accessor = accessor_at(document, index);
    const int type = accessor.componentType;
    if (accessor.type != TINYGLTF_TYPE_SCALAR ||
        (type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE && type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT &&
         type != TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT)) {
        return Error{"bad_gltf", place(index) + "/componentType", std::to_string(type),
                     "indices are scalar unsigned bytes, shorts or ints"};
    }
    std::vector<std::uint32_t> values(accessor.count, 0);
    const auto done = for_each_element(
        document, index, [&](std::size_t element, const std::byte* at) { values[element] = load_unsigned(at, type); });
    if (!done) return done.error();
    return values;
}

}  // namespace gonio
