#include "server/assets/assets.h"
namespace gonio {
std::shared_ptr<const SceneAsset> make_atrium() { return make_cornell(); }
}
