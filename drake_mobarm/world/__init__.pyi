from .obstacles import Obstacle as Obstacle
from .occupancy import OccupancyGrid as OccupancyGrid
from .places import Place as Place
from .places import check_places as check_places
from .sdf import load_world as load_world
from .sdf import world_names as world_names
from .world import World as World
