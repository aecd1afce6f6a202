// Vectors of messages.
#pragma once

#include <google/protobuf/repeated_field.h>

#include <glm/glm.hpp>

namespace gonio {

// Result: the vector that a field of three numbers holds. field: checked, it has three.
inline glm::dvec3 vector_of(const google::protobuf::RepeatedField<double>& field) {
    return {field[0], field[1], field[2]};
}

}  // namespace gonio
