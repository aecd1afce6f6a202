// What a photometric file calls its luminaire.
#pragma once

#include <string>

#include "ies/photometry.h"

namespace gonio::ies {

// Result: maker and luminaire as the keywords have them, for lists: "Maker Spot 12 W". The catalogue number stands in
// for a name. Empty where the file tells neither, and for the built-in luminaires, whose short names say more.
std::string product_name(const Provenance& provenance);

}  // namespace gonio::ies
