// Packets written as numbers, for tests of the relay.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <vector>

namespace gonio {

using Buffer = std::vector<std::byte>;

inline Buffer bytes(std::initializer_list<int> values) {
    Buffer buffer;
    for (const int value : values) buffer.push_back(static_cast<std::byte>(value));
    return buffer;
}

}  // namespace gonio
