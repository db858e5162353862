// The command of the fix: surfaces and keywords.

#include "fix_dpd_wall.h"

#include "atom.h"
#include "domain.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

using namespace LAMMPS_NS;
using namespace psidpd;

namespace {

const char KEYWORDS[] = "'density', 'type', 'species', 'local/density', 'strength', 'velocity', 'drag', 'drag/range', "
                        "'viscosity' or 'fluid/density'";

bool is_number(const char *text)
{
  char *end = nullptr;
  strtod(text, &end);
  return end != text && *end == '\0';
}

WallOfFix plain(Shape shape)
{
  WallOfFix wall{};
  wall.shape = shape;
  wall.strength = 1.0;
  wall.drag = wall.drag_range = -1.0;
  return wall;
}

}    // namespace

std::string psidpd::name_of(const WallOfFix &wall)
{
  if (wall.shape != Shape::Face) return wall.shape == Shape::Cylinder ? "cylinder" : "sphere";
  return std::string(1, "xyz"[wall.axis]) + (wall.high ? "hi" : "lo");
}

bool psidpd::is_same_face(const WallOfFix &one, const WallOfFix &two)
{
  return one.shape == Shape::Face && two.shape == Shape::Face && one.axis == two.axis && one.high == two.high;
}

bool psidpd::is_across(const WallOfFix &wall, int direction)
{
  const bool is_axis = direction == static_cast<int>(wall.axis);
  return wall.shape == Shape::Face ? is_axis : wall.shape == Shape::Sphere || !is_axis;
}

bool FixDPDWall::read_face(const std::string &word)
{
  if (word.size() != 3 || word[0] < 'x' || word[0] > 'z') return false;
  const std::string end = word.substr(1);
  if (end != "lo" && end != "hi") return false;
  WallOfFix wall = plain(Shape::Face);
  wall.axis = word[0] - 'x';
  wall.high = end == "hi";
  const auto is_same = [&](const WallOfFix &other) { return is_same_face(wall, other); };
  if (std::any_of(matter.begin(), matter.end(), is_same)) stop("face " + word + " is named twice");
  matter.push_back(wall);
  return true;
}

bool FixDPDWall::read_round(int &k, int narg, char **arg)
{
  const std::string word = arg[k];
  const bool has_axis = word == "cylinder";
  if (!has_axis && word != "sphere") return false;
  if (k + 5 >= narg) stop("expected '" + word + (has_axis ? " DIM C1 C2" : " X Y Z") + " RADIUS' and 'inside' or 'outside', where the fluid is");
  WallOfFix wall = plain(has_axis ? Shape::Cylinder : Shape::Sphere);
  if (has_axis) {
    const std::string dim = arg[k + 1];
    if (domain->dimension == 2) stop("in two dimensions a circle is a sphere, and there are no cylinders");
    if (dim != "x" && dim != "y" && dim != "z") stop("the axis of a cylinder is x, y or z, found '" + dim + "'");
    wall.axis = dim[0] - 'x';
  }
  int next = k + (has_axis ? 2 : 1);
  for (int c = 0; c < 3; c++) {
    if (has_axis && c == static_cast<int>(wall.axis)) continue;
    wall.center[c] = utils::numeric(FLERR, arg[next], false, lmp);
    if (!std::isfinite(wall.center[c])) stop(std::string("the center must be finite, found ") + arg[next]);
    next++;
  }
  wall.radius = number(arg[next], "radius", false);
  const std::string side = arg[next + 1];
  if (side != "inside" && side != "outside") stop("the fluid of a " + word + " is 'inside' or 'outside', found '" + side + "'");
  wall.inside = side == "inside";
  matter.push_back(wall);
  k = next + 1;
  return true;
}

double FixDPDWall::number(const char *text, const std::string &key, bool can_be_zero)
{
  const double value = utils::numeric(FLERR, text, false, lmp);
  if (!std::isfinite(value) || value < 0.0 || (value == 0.0 && !can_be_zero))
    stop(key + " must " + (can_be_zero ? "not be negative" : "be positive") + ", found " + text);
  return value;
}

int FixDPDWall::read_keyword(int k, int narg, char **arg)
{
  const std::string key = arg[k];
  const auto each = [this](auto change) { std::for_each(matter.begin(), matter.end(), change); };
  const int values = key == "velocity" ? 3 : 1;
  if (k + values >= narg)
    stop("keyword '" + key + "' needs " + (values == 1 ? "a value" : "three values"));
  const char *text = arg[k + 1];
  if (key == "density") {
    const double value = number(text, key, false);
    each([=](WallOfFix &wall) { wall.density = value; });
  } else if (key == "type") {
    const int type = utils::inumeric(FLERR, text, false, lmp);
    if (type < 1 || type > atom->ntypes) stop("there is no type " + std::string(text));
    each([=](WallOfFix &wall) { wall.kind = type; });
  } else if (key == "species") {
    const rust::String name = rust::String::lossy(text);
    each([&](WallOfFix &wall) { wall.species = name; });
  } else if (key == "local/density") {
    rust::Vec<double> all;
    for (; k + 1 < narg && (all.empty() || is_number(arg[k + 1])); k++) all.push_back(number(arg[k + 1], key, false));
    each([&](WallOfFix &wall) { wall.local_densities = all; });
    return k + 1;
  } else if (key == "strength") {
    const double value = number(text, key, true);
    each([=](WallOfFix &wall) { wall.strength = value; });
  } else if (key == "velocity") {
    std::array<double, 3> velocity{};
    for (int c = 0; c < 3; c++) {
      velocity[c] = utils::numeric(FLERR, arg[k + 1 + c], false, lmp);
      if (!std::isfinite(velocity[c])) stop(std::string("velocity must be finite, found ") + arg[k + 1 + c]);
    }
    each([=](WallOfFix &wall) { wall.velocity = velocity; });
  } else if (key == "drag") {
    const double value = number(text, key, true);
    each([=](WallOfFix &wall) { wall.drag = value; });
  } else if (key == "drag/range") {
    const double value = number(text, key, false);
    each([=](WallOfFix &wall) { wall.drag_range = value; });
  } else if (key == "viscosity") {
    const double value = number(text, key, false);
    each([=](WallOfFix &wall) { wall.viscosity = value; });
  } else if (key == "fluid/density") {
    const double value = number(text, key, false);
    each([=](WallOfFix &wall) { wall.fluid_density = value; });
  } else {
    stop("unknown keyword '" + key + "': expected " + KEYWORDS);
  }
  return k + 1 + values;
}

void FixDPDWall::check_surfaces()
{
  for (const WallOfFix &wall : matter) {
    const std::string name = name_of(wall);
    if (wall.shape != Shape::Face) {
      if (domain->triclinic) stop("a " + name + " needs a box without tilt");
      for (int c = 0; c < domain->dimension; c++)
        if (is_across(wall, c) && (domain->boundary[c][0] > 1 || domain->boundary[c][1] > 1))
          stop("the box follows the atoms across a " + name + ": it needs a 'boundary' of p or f there, not s or m");
      continue;
    }
    const int axis = static_cast<int>(wall.axis);
    if (axis >= domain->dimension) stop("a box of two dimensions has no face " + name);
    if (domain->periodicity[axis]) stop("the box is periodic across face " + name + ": a wall needs a 'boundary' of f there");
    if (domain->boundary[axis][wall.high] != 1)
      stop("face " + name + " follows the atoms: a wall needs a 'boundary' of f there, not s or m");
    // LAMMPS tilts a box along periodic directions only: the planes between the faces of z are across z.
    if (domain->triclinic && axis != 2) stop("in a tilted box only zlo and zhi can be walls, found " + name);
  }
}
