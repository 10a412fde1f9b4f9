from robsim.files.flat_table import to_table as to_table
from robsim.logs.bag_reader import BagImage as BagImage
from robsim.logs.bag_reader import read_bag as read_bag
from robsim.logs.bag_reader import read_bag_images as read_bag_images
from robsim.logs.bag_writer import write_bag as write_bag
from robsim.logs.table_log import read_log as read_log
