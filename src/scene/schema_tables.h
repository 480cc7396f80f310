// SPDX-License-Identifier: MIT
// The two halves of the schema table; only schema.cpp puts them together.
#pragma once
#include <utility>
#include <vector>

#include "src/scene/schema_builder.h"

namespace firn {

std::vector<TableSpec> world_tables();    // the top level, time, simulation, snow, ground, colliders
std::vector<TableSpec> picture_tables();  // camera, image, objects, lights, surfaces, output

// The keys of a shape, shared by [[snow]], [[collider]] and [[object]].
template <class Record>
void add_shape_keys(TableBuilder<Record>& table, const std::vector<std::string>& shapes) {
  const auto part = [](auto member) {
    return [member](Record & r) -> auto& { return r.shape.*member; };
  };
  const auto with = [&](std::vector<std::string> names) {
    std::erase_if(names, [&](const std::string& n) {
      return std::find(shapes.begin(), shapes.end(), n) == shapes.end();
    });
    return Condition{"shape", names};
  };
  table.key("shape", part(&ShapeConfig::shape),
            {.choices = shapes, .required = true, .meaning = "what it is shaped like"});
  // Keys that none of these shapes has are no keys of the table.
  const auto add = [&](const char* name, auto member, KeyNotes notes) {
    if (!notes.with.values.empty()) table.key(name, member, std::move(notes));
  };
  add("center", part(&ShapeConfig::center),
      {.unit = "m",
       .with = with({"ball", "box", "cylinder", "capsule", "flakes"}),
       .required = true,
       .meaning = "its centre"});
  add("radius", part(&ShapeConfig::radius),
      {.unit = "m",
       .range = above(0),
       .with = with({"ball", "cylinder", "capsule", "flakes"}),
       .required = true,
       .meaning = "of the ball, of the cylinder, of the capsule, of one flake"});
  add("size", part(&ShapeConfig::size),
      {.unit = "m",
       .range = above(0),
       .with = with({"box", "flakes"}),
       .required = true,
       .meaning = "full edge lengths; of flakes: of the region that they fill"});
  add("height", part(&ShapeConfig::height),
      {.unit = "m",
       .range = above(0),
       .with = with({"cylinder", "capsule"}),
       .required = true,
       .meaning = "full height, along its own Y axis; of a capsule: with its round ends"});
  add("rotation", part(&ShapeConfig::rotation),
      {.unit = "degrees",
       .with = with({"box", "cylinder", "capsule", "height_field", "mesh", "particles"}),
       .meaning = "turns it about x, then y, then z, about its centre; of a file, about the file's origin"});
  add("file", part(&ShapeConfig::file),
      {.with = with({"mesh", "height_field", "particles"}),
       .required = true,
       .meaning =
           "mesh: a closed OBJ; height_field: a PGM picture or an ESRI ASCII grid; particles: points, as "
           ".npz or .npy of NumPy, .ply or a particle file of firn; relative to the scene file"});
  add("offset", part(&ShapeConfig::offset),
      {.unit = "m",
       .with = with({"mesh", "height_field", "particles"}),
       .meaning = "where the file's origin goes"});
  add("scale", part(&ShapeConfig::scale),
      {.unit = "m",
       .range = above(0),
       .with = with({"mesh", "particles"}),
       .meaning = "metres per unit of the file"});
  add("extent", part(&ShapeConfig::extent),
      {.unit = "m",
       .range = above(0),
       .with = with({"height_field"}),
       .absent = "as the grid says; a PGM needs it",
       .meaning = "width (x), height range (y), depth (z), centred on the offset"});
  add("base", part(&ShapeConfig::base),
      {.unit = "m",
       .with = with({"height_field"}),
       .absent = "0 for snow, below everything else for the rest",
       .meaning = "where the solid below the surface ends"});
}

template <class Record>
void add_plane_keys(TableBuilder<Record>& table) {
  const auto part = [](auto member) {
    return [member](Record & r) -> auto& { return r.shape.*member; };
  };
  const Condition plane{"shape", {"plane"}};
  table.key("point", part(&ShapeConfig::point),
            {.unit = "m", .with = plane, .required = true, .meaning = "a point of the plane"});
  table.key("normal", part(&ShapeConfig::normal),
            {.with = plane, .required = true, .meaning = "the side that is free, any length"});
}

}  // namespace firn
