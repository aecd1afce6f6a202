// The white of the picture: which colour of light is shown as neutral. Pure, any thread.
#pragma once

#include <glm/glm.hpp>

namespace gonio {

// Result: linear Rec.709 -> linear Rec.709, by which white_xy (server/scene/white.h) of that correlated colour
// temperature and duv becomes D65 (von Kries in the Bradford primaries, Lam 1985). 0 K: the identity.
glm::dmat3 white_balance(double white_k, double white_duv);

}  // namespace gonio
