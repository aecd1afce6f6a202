// What C++ and GLSL share is checked against the programs' own introspection; every program the pipeline can ask for
// compiles.
#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <set>
#include <string>
#include <vector>

#include "server/gl/program.h"
#include "server/render/passes/composite_defines.h"
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

// Result: the texture units of a program's samplers, one for each.
std::vector<GLint> units_of(GLuint program) {
    GLint count = 0;
    glGetProgramiv(program, GL_ACTIVE_UNIFORMS, &count);
    std::vector<GLint> units;
    for (GLint i = 0; i < count; ++i) {
        char name[64];
        GLint size = 0;
        GLenum type = 0;
        glGetActiveUniform(program, static_cast<GLuint>(i), sizeof name, nullptr, &size, &type, name);
        if (type != GL_SAMPLER_2D && type != GL_SAMPLER_2D_ARRAY && type != GL_SAMPLER_CUBE) continue;
        glGetUniformiv(program, glGetUniformLocation(program, name), &units.emplace_back());
    }
    return units;
}

// Whatever a client asks for: composite.frag links with each set of options, which it does not where two uniforms have
// one location. No two textures have one unit.
TEST(Programs, EveryCompositeLinks) {
    std::set<gl::Defines> sets;
    for (int view = 0; view <= static_cast<int>(View::solid); ++view)
        for (int bits = 0; bits < 64; ++bits)
            for (int tone = -1; tone <= static_cast<int>(Tone::neutral); ++tone) {
                CompositeParts parts;
                parts.view = static_cast<View>(view);
                int next = 0;
                for (bool* part :
                     {&parts.raw, &parts.emissive, &parts.openings, &parts.edges, &parts.haze, &parts.work_light})
                    *part = (bits >> next++ & 1) != 0;
                if (tone >= 0) parts.look = {static_cast<Tone>(tone), 4000.0, 0.0};
                sets.insert(composite_defines(parts));
            }
    EXPECT_GT(sets.size(), 400u);
    for (const gl::Defines& defines : sets) {
        std::string said;
        for (const auto& [name, value] : defines) said += name + "=" + value + " ";
        try {
            const gl::Program program = gl::make_program("passes/screen.vert", "passes/composite.frag", defines);
            std::vector<GLint> units = units_of(program.id());
            std::sort(units.begin(), units.end());
            EXPECT_EQ(std::adjacent_find(units.begin(), units.end()), units.end()) << said;
        } catch (const gl::ProgramError& error) {
            ADD_FAILURE() << said << error.what();
        }
    }
    std::printf("%zu sets of options\n", sets.size());
}

}  // namespace
}  // namespace gonio::test
