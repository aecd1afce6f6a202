#include "server/session/file_place.h"

#include <algorithm>
#include <vector>

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

namespace gonio {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

constexpr std::string_view kPositions[] = {
    "gonio.v1.BeamEdge.points_m",    "gonio.v1.Bounds.max_m",        "gonio.v1.Bounds.min_m",
    "gonio.v1.Camera.eye",           "gonio.v1.Camera.target",       "gonio.v1.Grid.corner_m",
    "gonio.v1.GridValues.points_m",  "gonio.v1.Light.position",      "gonio.v1.MeterQuery.point_m",
    "gonio.v1.MeterReading.point_m", "gonio.v1.Observer.eye_m",      "gonio.v1.Pick.point_m",
    "gonio.v1.SaveView.eye_m",       "gonio.v1.SaveView.target_m",   "gonio.v1.SetCamera.eye_m",
    "gonio.v1.SetCamera.target_m",   "gonio.v1.SetLight.position_m", "gonio.v1.UgrQuery.eye_m",
};

void add_to_numbers(Message& message, const Reflection& reflection, const FieldDescriptor* field,
                    const glm::dvec3& place) {
    const int count = reflection.FieldSize(message, field);
    if (count % 3 != 0) return;
    for (int i = 0; i < count; ++i) {
        const double number = reflection.GetRepeatedDouble(message, field, i) + place[i % 3];
        reflection.SetRepeatedDouble(&message, field, i, number);
    }
}

}  // namespace

std::span<const std::string_view> position_fields() {
    return kPositions;
}

void add_place(Message& message, const glm::dvec3& place) {
    if (place == glm::dvec3(0.0)) return;
    const Reflection& reflection = *message.GetReflection();
    std::vector<const FieldDescriptor*> fields;
    reflection.ListFields(message, &fields);
    for (const FieldDescriptor* field : fields) {
        if (field->cpp_type() == FieldDescriptor::CPPTYPE_DOUBLE && field->is_repeated() &&
            std::ranges::find(kPositions, std::string_view(field->full_name())) != std::end(kPositions))
            add_to_numbers(message, reflection, field, place);
        if (field->cpp_type() != FieldDescriptor::CPPTYPE_MESSAGE) continue;
        if (!field->is_repeated()) {
            add_place(*reflection.MutableMessage(&message, field), place);
            continue;
        }
        for (int i = 0; i < reflection.FieldSize(message, field); ++i)
            add_place(*reflection.MutableRepeatedMessage(&message, field, i), place);
    }
}

}  // namespace gonio
