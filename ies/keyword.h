// Keywords of a photometric file by name. Internal to ies/.
#pragma once

#include <string_view>

#include "ies/photometry.h"

namespace gonio::ies {

// Result: the first keyword's value; empty: the file has none. Stands as long as `provenance`.
inline std::string_view keyword_of(const Provenance& provenance, std::string_view key) {
    for (const auto& [name, value] : provenance.keywords)
        if (name == key) return value;
    return {};
}

}  // namespace gonio::ies
