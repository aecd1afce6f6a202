#include "ies/product.h"

#include <string_view>

#include "ies/keyword.h"
#include "ies/synthetic.h"

namespace gonio::ies {
namespace {

// Result: empty also of "unknown", as our own writer has what a file does not tell.
std::string_view told(const Provenance& provenance, std::string_view key) {
    const std::string_view value = keyword_of(provenance, key);
    return value == "unknown" ? std::string_view() : value;
}

}  // namespace

std::string product_name(const Provenance& provenance) {
    const std::string_view maker = told(provenance, "MANUFAC"), luminaire = told(provenance, "LUMINAIRE"),
                           name = luminaire.empty() ? told(provenance, "LUMCAT") : luminaire;
    if (name.empty() || maker == kSyntheticMaker) return {};
    if (maker.empty() || name.starts_with(maker)) return std::string(name);
    return std::string(maker) + " " + std::string(name);
}

}  // namespace gonio::ies
