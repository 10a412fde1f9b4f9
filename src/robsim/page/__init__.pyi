from robsim.page.export import export_html as export_html
from robsim.page.export import load_recording as load_recording
from robsim.page.export import show as show
from robsim.page.recording_builder import Recording as Recording
