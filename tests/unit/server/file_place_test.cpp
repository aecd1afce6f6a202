// Positions of clients of a scene in survey coordinates: those of its file, to the millimetre, in every message.
#include "server/session/file_place.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <google/protobuf/descriptor.h>

#include "protocol/schema/command.pb.h"
#include "protocol/schema/gonio.pb.h"
#include "protocol/schema/grid.pb.h"
#include "protocol/schema/light.pb.h"
#include "protocol/schema/measure.pb.h"
#include "protocol/schema/state.pb.h"

namespace gonio {
namespace {

const glm::dvec3 kPlace{350'000.0, 0.0, 4'500'000.0};

// Lists of numbers that are no positions: directions, edges, colours, curves and levels.
const std::set<std::string> kOther{
    "gonio.v1.FalseColor.levels",
    "gonio.v1.FalseColor.ticks",
    "gonio.v1.GelMeasurement.of_xy",
    "gonio.v1.GelMeasurement.xy",
    "gonio.v1.Grid.direction",
    "gonio.v1.Grid.u_m",
    "gonio.v1.Grid.v_m",
    "gonio.v1.GridValues.cell_m",
    "gonio.v1.GridValues.values_lx",
    "gonio.v1.Levels.values",
    "gonio.v1.Light.aim",
    "gonio.v1.Light.c0",
    "gonio.v1.Light.color_rgb",
    "gonio.v1.MeterQuery.normal",
    "gonio.v1.MeterQuery.u_m",
    "gonio.v1.MeterQuery.v_m",
    "gonio.v1.MeterReading.direct_rgb_lx",
    "gonio.v1.MeterReading.indirect_rgb_lx",
    "gonio.v1.Observer.direction",
    "gonio.v1.Pick.normal",
    "gonio.v1.ProfileReply.c0_cd",
    "gonio.v1.ProfileReply.c180_cd",
    "gonio.v1.ProfileReply.c270_cd",
    "gonio.v1.ProfileReply.c90_cd",
    "gonio.v1.ProfileReply.v_deg",
    "gonio.v1.SetLight.aim",
    "gonio.v1.SetLight.color_rgb",
    "gonio.v1.UgrQuery.direction",
};

void collect(const google::protobuf::Descriptor* message, std::set<const google::protobuf::Descriptor*>& seen,
             std::set<std::string>& lists) {
    if (!seen.insert(message).second) return;
    for (int i = 0; i < message->field_count(); ++i) {
        const google::protobuf::FieldDescriptor* field = message->field(i);
        if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_MESSAGE)
            collect(field->message_type(), seen, lists);
        if (!field->is_repeated()) continue;
        if (field->cpp_type() == google::protobuf::FieldDescriptor::CPPTYPE_DOUBLE)
            lists.insert(std::string(field->full_name()));
        EXPECT_NE(field->cpp_type(), google::protobuf::FieldDescriptor::CPPTYPE_FLOAT)
            << field->full_name() << " is too coarse";
    }
}

// Whoever adds a list of numbers to the protocol says here whether it holds positions.
TEST(FilePlace, EveryListOfNumbersIsAPositionOrIsNone) {
    std::set<const google::protobuf::Descriptor*> seen;
    std::set<std::string> lists;
    collect(v1::ClientMessage::descriptor(), seen, lists);
    collect(v1::ServerMessage::descriptor(), seen, lists);
    std::set<std::string> known = kOther;
    for (const std::string_view field : position_fields()) {
        EXPECT_TRUE(lists.contains(std::string(field))) << field << " is in no message";
        EXPECT_TRUE(known.insert(std::string(field)).second) << field;
    }
    for (const std::string& list : lists) EXPECT_TRUE(known.contains(list)) << list;
    for (const std::string& other : kOther) EXPECT_TRUE(lists.contains(other)) << other << " is in no message";
}

// Steps of a double are 1e-9 m at 4,500,000 m.
TEST(FilePlace, MillimetresSurviveTheWayInAndOut) {
    for (int i = 0; i < 2000; ++i) {
        const double step_m = 0.001 * i;
        v1::ClientMessage in;
        v1::SetLight& set = *in.mutable_command()->mutable_set_light();
        for (const double number : {350'000.0 + step_m, 3.0 + step_m, 4'500'000.0 + step_m}) set.add_position_m(number);
        add_place(in, -kPlace);
        for (const int k : {0, 2}) EXPECT_NEAR(set.position_m(k), step_m, 1e-9);
        v1::ServerMessage out;
        v1::Light& light = *out.mutable_state()->add_lights();
        *light.mutable_position() = set.position_m();
        light.add_aim(1.0);
        add_place(out, kPlace);
        EXPECT_EQ(light.position(0), 350'000.0 + step_m);
        EXPECT_EQ(light.position(1), 3.0 + step_m);
        EXPECT_EQ(light.position(2), 4'500'000.0 + step_m);
        EXPECT_EQ(light.aim(0), 1.0);
    }
}

TEST(FilePlace, ListsOfPointsAndNestedMessagesAreMoved) {
    v1::ServerMessage message;
    v1::State& state = *message.mutable_state_changed()->mutable_state();
    for (int k = 0; k < 3; ++k) {
        state.mutable_camera()->add_eye(k);
        state.mutable_bounds()->add_max_m(k);
        state.mutable_saved_views()->add_views()->mutable_camera()->add_target(k);
        state.mutable_grids()->add_grids();
        state.mutable_grids()->mutable_grids(0)->add_corner_m(k);
        state.mutable_grids()->mutable_grids(0)->add_u_m(k);
    }
    add_place(message, kPlace);
    EXPECT_EQ(state.camera().eye(2), 4'500'002.0);
    EXPECT_EQ(state.bounds().max_m(0), 350'000.0);
    EXPECT_EQ(state.grids().grids(0).corner_m(2), 4'500'002.0);
    EXPECT_EQ(state.grids().grids(0).u_m(2), 2.0) << "an edge, not a position";
    EXPECT_EQ(state.saved_views().views(0).camera().target(0), 0.0) << "one number is no position";
    v1::GridValues values;
    for (int k = 0; k < 6; ++k) values.add_points_m(k);
    add_place(values, kPlace);
    EXPECT_EQ(values.points_m(3), 350'003.0);
    EXPECT_EQ(values.points_m(5), 4'500'005.0);
}

}  // namespace
}  // namespace gonio
