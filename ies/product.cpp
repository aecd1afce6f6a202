#include "ies/product.h"

#include <string_view>

#include "ies/synthetic.h"

namespace gonio::ies {
namespace {

std::string_view keyword(const Provenance& provenance, std::string_view wanted) {
    for (const auto& [key, value] : provenance.keywords)
        if (key == wanted && value != "unknown") return value;
    return {};
}

}  // namespace

std::string product_name(const Provenance& provenance) {
    const std::string_view maker = keyword(provenance, "MANUFAC"), luminaire = keyword(provenance, "LUMINAIRE"),
                           name = luminaire.empty() ? keyword(provenance, "LUMCAT") : luminaire;
    if (name.empty() || maker == kSyntheticMaker) return {};
    if (maker.empty() || name.starts_with(maker)) return std::string(name);
    return std::string(maker) + " " + std::string(name);
}

}  // namespace gonio::ies
