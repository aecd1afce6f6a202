// A copy of a seed with a few bytes changed or cut out: a short deterministic fuzzing run for unit tests.
#pragma once

#include <cstddef>
#include <random>
#include <string>

namespace gonio::fuzz {

// Result: the bytes after so many changes, each a byte replaced or up to eight removed; no more once nothing is left.
inline std::string damaged(std::string bytes, unsigned changes, std::mt19937& random) {
    for (; changes > 0 && !bytes.empty(); --changes) {
        const std::size_t at = random() % bytes.size();
        if (random() % 4 == 0)
            bytes.erase(at, 1 + random() % 8);
        else
            bytes[at] = static_cast<char>(random());
    }
    return bytes;
}

}  // namespace gonio::fuzz
