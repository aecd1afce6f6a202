// What C++ and GLSL share is checked against the programs' own introspection; every program the pipeline can ask for
// compiles.
#include <cstddef>
#include <string>

#include "server/gl/program.h"
#include "shaders/shared/layouts.h"
#include "tests/gl/test_context.h"

namespace gonio::test {
namespace {

GLint member_offset(GLuint program, const std::string& name, GLenum interface = GL_UNIFORM) {
    const GLuint index = glGetProgramResourceIndex(program, interface, name.c_str());
    EXPECT_NE(index, GL_INVALID_INDEX) << name;
    const GLenum property = GL_OFFSET;
    GLint offset = -1;
    glGetProgramResourceiv(program, interface, index, 1, &property, 1, nullptr, &offset);
    return offset;
}

TEST(Layout, LightWeight) {
    const gl::Program program = gl::make_program("passes/screen.vert", "passes/composite.frag", {{"VIEW", "0"}});
    EXPECT_EQ(member_offset(program.id(), "weights[3].rgb"), static_cast<GLint>(3 * sizeof(layouts::LightWeight)));
}

// Storage buffers.
TEST(Layout, WhatIsPacked) {
    const auto offset_in = [](const gl::Program& program, const char* name) {
        return static_cast<std::size_t>(member_offset(program.id(), name, GL_BUFFER_VARIABLE));
    };
    const gl::Program weights = gl::make_program("passes/screen.vert", "passes/gather_weights.frag", {});
    EXPECT_EQ(offset_in(weights, "triangles[0].side"), offsetof(layouts::CellTriangle, side));
    EXPECT_EQ(offset_in(weights, "surfels[0].normal"), offsetof(layouts::SurfelDisc, normal));
    const gl::Program gather = gl::make_program("passes/screen.vert", "passes/gather.frag", {});
    EXPECT_EQ(offset_in(gather, "irradiance[0].blue"), offsetof(layouts::HalfIrradiance, blue));
    const gl::Program mask = gl::make_program("passes/screen.vert", "passes/mask.frag", {{"CUBE", "1"}, {"SUB", "1"}});
    EXPECT_EQ(offset_in(mask, "web.table"), offsetof(layouts::WebHeader, table));
    EXPECT_EQ(offset_in(mask, "web_values[0]"), sizeof(layouts::WebHeader));
    const gl::Program cells = gl::make_program("passes/mesh.vert", "passes/gbuffer.frag", {{"CELLS", "2"}});
    EXPECT_EQ(offset_in(cells, "vertices[0].z"), offsetof(layouts::MeshVertex, z));
}

// DrawInstance goes in by vertex attributes, whose offsets C++ takes from the struct itself; their locations are
// checked.
TEST(Layout, DrawInstanceAttributes) {
    const gl::Program program = gl::make_program("passes/mesh.vert", "passes/rsm.frag", {{"CUBE", "1"}});
    EXPECT_EQ(glGetAttribLocation(program.id(), "in_row0"), 3);
    EXPECT_EQ(glGetAttribLocation(program.id(), "in_row1"), 4);
    EXPECT_EQ(glGetAttribLocation(program.id(), "in_row2"), 5);
    EXPECT_EQ(glGetAttribLocation(program.id(), "in_face"), 6);
}

TEST(Programs, EveryOptionSetCompiles) {
    const auto make = [](const char* vertex, const char* fragment, const gl::Defines& defines) {
        EXPECT_NO_THROW(gl::make_program(vertex, fragment, defines)) << fragment;
    };
    for (int bits = 0; bits < 16; ++bits) {
        gl::Defines surface, cube = {{"CUBE", "1"}};
        if (bits & 1) surface.emplace_back("MASKED", "1"), cube.emplace_back("MASKED", "1");
        if (bits & 2) surface.emplace_back("TEXTURED", "1"), cube.emplace_back("TEXTURED", "1");
        if (bits & 4) surface.emplace_back("EMISSIVE", "1");
        if (bits & 8) surface.emplace_back("EMISSIVE_TEXTURED", "1"), cube.emplace_back("SEED", "1");
        make("passes/mesh.vert", "passes/gbuffer.frag", surface);
        make("passes/mesh.vert", "passes/rsm.frag", cube);
        make("passes/mesh.vert", (bits & 1) != 0 ? "passes/shadow.frag" : "", cube);
    }
    make("passes/mesh.vert", "passes/gbuffer.frag", {{"CELLS", "2"}, {"BODY", "1"}});
    make("passes/mesh.vert", "passes/gbuffer.frag", {{"CELLS", "3"}, {"EMISSIVE", "1"}, {"BODY", "1"}});
    for (int view = 0; view < 10; ++view) {
        for (int bits = 0; bits < 4; ++bits) {
            gl::Defines defines = {{"VIEW", std::to_string(view)}};
            if (bits & 1) defines.emplace_back("RAW", "1");
            if (bits & 2) defines.emplace_back("EMISSIVE", "1");
            make("passes/screen.vert", "passes/composite.frag", defines);
        }
    }
    for (const char* tone : {"0", "1", "2", "3", "4"})
        make("passes/screen.vert", "passes/composite.frag", {{"VIEW", "0"}, {"TONE", tone}});
    for (const char* view : {"0", "3", "4"})
        make("passes/screen.vert", "passes/composite.frag", {{"VIEW", view}, {"EDGES", "1"}});
    for (const char* sub : {"1", "2", "3"}) {
        make("passes/screen.vert", "passes/mask.frag", {{"CUBE", "1"}, {"SUB", sub}});
        make("passes/screen.vert", "passes/mask.frag", {{"CUBE", "1"}, {"SUB", sub}, {"UNIFORM_WEB", "1"}});
    }
    make("passes/screen.vert", "passes/direct.frag", {{"UNIFORM_WEB", "1"}});
    make("passes/screen.vert", "passes/flux.frag", {{"CUBE", "1"}});
    make("passes/screen.vert", "passes/direct.frag", {});
    make("passes/screen.vert", "passes/gather_seed.frag", {});
    make("passes/screen.vert", "passes/gather_seed.frag", {{"DISK", "1"}});
    make("passes/screen.vert", "passes/nv12.frag", {});
    make("passes/solid.vert", "passes/solid.frag", {});
}

}  // namespace
}  // namespace gonio::test
