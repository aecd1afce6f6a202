// A hash of what a scene's light follows from, by which references are kept on disk.
#pragma once

#include <cstdint>
#include <type_traits>
#include <vector>

#include "server/scene/asset.h"

namespace gonio {
struct Scene;
}  // namespace gonio

namespace gonio::bench {

// FNV-1a, 64 bits, over the object representation of plain values.
struct Hash {
    std::uint64_t value = 14695981039346656037ull;

    void bytes(const void* data, std::size_t size) {
        const auto* p = static_cast<const unsigned char*>(data);
        for (std::size_t i = 0; i < size; ++i) value = (value ^ p[i]) * 1099511628211ull;
    }
    template <typename T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T>
    void add(T x) { bytes(&x, sizeof x); }
    void add(const glm::dvec3& v) { bytes(&v[0], sizeof v); }
    template <typename T>
    void add(const std::vector<T>& values) {
        static_assert(std::is_arithmetic_v<T> || std::is_same_v<T, Vertex>);  // no padding
        add(values.size());
        if (!values.empty()) bytes(values.data(), values.size() * sizeof(T));
    }
    // Everything that the scene's light and the view of its camera follow from.
    void add(const Scene& scene);
};

}  // namespace gonio::bench
